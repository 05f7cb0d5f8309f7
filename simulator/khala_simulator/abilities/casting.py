"""Using abilities: whether a unit may now, what it costs, and how a use begins, takes effect and ends.

This module holds what is the same for every ability: who has it, requirements, cost, cooldown, target filters. The
ability's ``skills.Skill`` holds what it does. Players enter through ``use``, units with autocast through
``systems.autocast``; ``systems.casts`` carries out what does not happen at once.

Above: the API, ``systems``. Below: ``skills``, ``commands``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.registry import SKILLS, SMARTS
from khala_simulator.abilities.skill import touching
from khala_simulator.economy import payments, supply
from khala_simulator.economy.requirements import met
from khala_simulator.native import columns
from khala_simulator.tables import prices
from khala_simulator.tables.abilities import AbilityAim
from khala_simulator.tables.action_result import EXCLUDED, NOT_REQUIRED, ActionResult
from khala_simulator.tables.stats import AIR_PLANE, GROUND_PLANE
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind
from khala_simulator.world.world import NO_TAG, Mishap

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from khala_simulator.abilities.skill import Skill
    from khala_simulator.tables.abilities import Ability, Filter
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

ANYWHERE: Final = 500.0
ORDINARY: Final = frozenset({"smart", "stop", "move", "patrol", "hold_position", "scan_move", "attack"})
"""What ``commands`` carries out; everything else is a skill."""
WALKS: Final = frozenset({"move", "patrol", "hold_position", "scan_move"})
MORPHS: Final = frozenset({"morph", "grow", "root", "burrow_tumor", "lift", "land"})
"""Abilities whose time, or a random part of it, passes before they take effect."""
PAID_FIRST: Final = frozenset({"grow"})
"""Abilities that are paid for when they begin: their time passes after the effect."""


def is_modelled(ability: Ability) -> bool:
    """Return whether the simulator has a rule for this ability."""
    return ability.effect in ORDINARY or ability.effect in SKILLS


def as_is(world: World, slot: int, ability: Ability) -> Ability:
    """Return the ability as a unit has it now, with the changes of its owner's upgrades."""
    c = columns.columns_of(world)
    return world.stats.ability(c.owner[slot], ability)


def prep_loops(world: World, slot: int, ability: Ability) -> float:
    """Return the loops between a unit's readiness to use an ability and its effect; a morph's time comes before it."""
    ability = as_is(world, slot, ability)
    loops = ability.intro_loops + ability.prep_loops
    if ability.effect not in MORPHS:
        return loops
    if ability.effect not in PAID_FIRST:
        loops += ability.loops
    return loops + (world.rng.random() * ability.random_loops if ability.random_loops else 0.0)


# may it ---------------------------------------------------------------------------------------------------------------


def refusal(world: World, slot: int, ability: Ability, *, free: bool = False) -> ActionResult:
    """Return why a unit can't use an ability of its card now, or success, for any target; ``free`` ignores the cost."""
    if not is_modelled(ability):
        return ActionResult.NOT_SUPPORTED
    if ability.effect in ORDINARY:
        return _ordinary_refusal(world, slot, ability)
    why = _unready(world, slot, ability)
    return why if free or why is not ActionResult.SUCCESS else _unaffordable(world, slot, ability)


def _unready(world: World, slot: int, ability: Ability) -> ActionResult:
    skill = SKILLS[ability.effect]
    if not (world.powered[slot] or skill.anytime):
        return ActionResult.CANT_TRAIN_TOO_FAR_FROM_POWER
    if not (world.can_cast[slot] or skill.anytime) or world.hallucination[slot]:
        return ActionResult.YOU_CANT_ISSUE_COMMANDS_TO_THAT_UNIT
    if not (met(world, slot, ability.requires) and met(world, slot, ability.shown_if)):
        return ActionResult.TECH_REQUIREMENTS_NOT_MET
    return ActionResult.SUCCESS if skill.ready is None else skill.ready(world, slot, ability)


def _ordinary_refusal(world: World, slot: int, ability: Ability) -> ActionResult:
    c = columns.columns_of(world)
    if c.build_progress[slot] < 1.0:
        return ActionResult.BUILDING_IS_UNDER_CONSTRUCTION
    stuck = ability.effect in WALKS and not commands.can_move(world, slot)
    return ActionResult.UNIT_CANT_MOVE if stuck else ActionResult.SUCCESS


def _unaffordable(world: World, slot: int, ability: Ability) -> ActionResult:
    player = world.players[int(world.owner[slot])]
    if "free" not in player.cheats:
        if player.minerals < ability.minerals:
            return ActionResult.NOT_ENOUGH_MINERALS
        if player.vespene < ability.vespene:
            return ActionResult.NOT_ENOUGH_VESPENE
        if world.energy[slot] < ability.energy:
            return ActionResult.NOT_ENOUGH_ENERGY
        if ability.life and world.life[slot] <= ability.life:
            return ActionResult.NOT_ENOUGH_LIFE
    if not supply.has_room(world, player.id, ability.supply):
        return ActionResult.NOT_ENOUGH_FOOD
    waits = "cooldown" not in player.cheats and cooldown_left(world, slot, ability) > 0.0
    return ActionResult.COOLDOWN if waits else ActionResult.SUCCESS


def cooldown_left(world: World, slot: int, ability: Ability) -> float:
    """Return the loops until the ability's cooldown is over, 0 when it is."""
    timers = world.players[int(world.owner[slot])].timers if ability.cooldown_shared else world.timers.get(slot, {})
    return max(0.0, timers.get(ability.timer, 0.0) - world.loop)


def aim_refusal(world: World, cast: Cast) -> ActionResult:
    """Return why a unit can't aim an ability like this, or success; the way there only counts if it can't walk."""
    slot, ability, target = cast.slot, cast.ability, cast.target
    if target == NOBODY and cast.point is None and ability.requires_point:
        return wrong_aim(ability)
    if target != NOBODY:
        wrong = fits(world, slot, target, ability.filters)
        if wrong is not ActionResult.SUCCESS:
            return wrong
    far = (
        SKILLS[ability.effect].give is None
        and ability.range < ANYWHERE
        and (target != NOBODY or cast.point is not None)
    )
    if far and world.step_max[slot] <= 0.0 and not in_range(world, cast, slop=0.0):
        return ActionResult.TARGET_IS_OUT_OF_RANGE
    return SKILLS[ability.effect].refuse(world, cast)


def wrong_aim(ability: Ability) -> ActionResult:
    """Return the refusal of an ability that is aimed at another kind of target than it can be."""
    if AbilityAim.POINT in ability.aim:
        return ActionResult.MUST_TARGET_VISIBLE_LOCATION
    return ActionResult.MUST_TARGET_UNIT if AbilityAim.UNIT in ability.aim else ActionResult.ERROR


def fits(world: World, slot: int, target: int, words: Filter) -> ActionResult:
    """Return why the catalog's filter forbids a unit as the target of another unit's ability, or success."""
    for word in words.required:
        if not _is(world, slot, target, word):
            return NOT_REQUIRED.get(word, ActionResult.CANT_TARGET_THAT_UNIT)
    for word in words.excluded:
        if _is(world, slot, target, word):
            return EXCLUDED.get(word, ActionResult.CANT_TARGET_THAT_UNIT)
    return ActionResult.SUCCESS


def _is(world: World, slot: int, target: int, word: str) -> bool:
    """Return whether a word of a filter holds for a target; words for things that the world lacks never do."""
    rule = WORDS.get(word)
    return rule is not None and bool(rule(world, slot, target))


def _owned_by(owner: str) -> Callable[[World, int, int], bool]:
    def rule(world: World, slot: int, target: int) -> bool:
        mine, its = int(world.owner[slot]), int(world.owner[target])
        kind = "Player" if mine == its else "Neutral" if its == 0 else "Enemy"
        return kind == owner

    return rule


def _attribute(name: str) -> Callable[[World, int, int], bool]:
    return lambda world, _, target: name in world.unit_type(target).attributes


def _flag(name: str) -> Callable[[World, int, int], bool]:
    def rule(world: World, _: int, target: int) -> bool:
        return any(name in world.catalog.buffs[row].flags for row in world.buffs.of(target)["buff"].tolist())

    return rule


WORDS: Final[dict[str, Callable[[World, int, int], bool]]] = {
    "Self": lambda _, slot, target: slot == target,
    "Player": _owned_by("Player"),
    "Neutral": _owned_by("Neutral"),
    "Enemy": _owned_by("Enemy"),
    "Visible": lambda world, slot, target: bool(world.visible[world.owner[slot], target]),
    "Air": lambda world, _, target: bool(world.plane_bits[target] & AIR_PLANE),
    "Ground": lambda world, _, target: bool(world.plane_bits[target] & GROUND_PLANE),
    "Structure": lambda world, _, target: world.unit_type(target).structure,
    "Biological": _attribute("biological"),
    "Mechanical": _attribute("mechanical"),
    "Psionic": _attribute("psionic"),
    "Massive": _attribute("massive"),
    "Light": _attribute("light"),
    "Armored": _attribute("armored"),
    "Heroic": _attribute("heroic"),
    "CanHaveEnergy": lambda world, _, target: bool(world.energy_max[target] > 0.0),
    "HasEnergy": lambda world, _, target: bool(world.energy[target] > 0.0),
    "Worker": lambda world, _, target: world.unit_type(target).worker,
    "Buried": lambda world, _, target: bool(world.burrowed[target]),
    "Cloaked": lambda world, _, target: bool(world.cloaked[target]),
    "UnderConstruction": lambda world, _, target: bool(world.build_progress[target] < 1.0),
    "Hallucination": lambda world, _, target: bool(world.hallucination[target]),
    "Invulnerable": lambda world, _, target: world.unit_type(target).invulnerable or not world.targetable[target],
    "Stasis": _flag("stasis"),
    "Benign": _flag("benign"),
    "Destructible": lambda world, _, target: int(world.owner[target]) == 0 and world.unit_type(target).structure,
}


def in_range(world: World, cast: Cast, *, slop: float | None = None) -> bool:
    """Return whether a unit is near enough for its ability, edge to edge; ``slop`` is the tolerance beyond it."""
    ability = cast.ability
    away = _distance(world, cast)
    if away is None or ability.range >= ANYWHERE:
        return True
    return away <= reach(world, cast) + (ability.slop if slop is None else slop) + 1e-6


def _distance(world: World, cast: Cast) -> float | None:
    """Return the distance from the caster's centre to the target's or the point; None for a cast at nothing."""
    goal = world.pos[cast.target].tolist() if cast.target != NOBODY else cast.point
    if goal is None:
        return None
    x, y = world.pos[cast.slot].tolist()
    return math.hypot(goal[0] - x, goal[1] - y)


def reach(world: World, cast: Cast) -> float:
    """Return how near a caster must come, centre to centre."""
    if cast.ability.overhead:
        return 0.0
    if cast.target != NOBODY and cast.ability.range == 0.0:
        return touching(world, cast.slot, cast.target) + cast.ability.slop
    body = float(world.radius[cast.target]) if cast.target != NOBODY else 0.0
    return cast.ability.range + float(world.radius[cast.slot]) + body


# use it ---------------------------------------------------------------------------------------------------------------


def use(
    world: World,
    slots: Iterable[int],
    ability: Ability,
    *,
    target: int = NO_TAG,
    point: Point | None = None,
    queue: bool = False,
) -> list[int]:
    """Make units use an ability on a unit (tag), at a point or on nothing; return the slots that will.

    Units that can't are left alone. Only the nearest of several units uses an ability that is ``solo``.
    """
    victim = world.slot_of(target)
    casts = [Cast(slot, as_is(world, slot, ability), victim, point) for slot in slots]
    casts = [c for c in casts if refusal(world, c.slot, c.ability) is ActionResult.SUCCESS]
    casts = [c for c in casts if aim_refusal(world, c) is ActionResult.SUCCESS]
    return order(world, casts, ability, queue=queue) if casts else []


def order(world: World, casts: Sequence[Cast], ability: Ability, *, queue: bool = False) -> list[int]:
    """Make units carry out casts of one ability that nothing forbids; return the slots that will."""
    target, point = casts[0].target, casts[0].point
    give = SKILLS[ability.effect].give
    if give is not None:
        return give(world, [cast.slot for cast in casts], ability, world.tag_of(target), point, queue)
    if ability.solo and len(casts) > 1:
        casts = [min(casts, key=lambda c: (_busy(world, c), _away(world, c), c.slot))]
    taken: list[int] = []
    for cast in casts:
        if ability.transient and not queue:
            perform(world, cast)
            taken.append(cast.slot)
        else:
            waiting = Order(OrderKind.CAST, ability.id, target=world.tag_of(target), point=point)
            taken += commands.give(world, [cast.slot], waiting, queue=queue)
    return taken


def smart(
    world: World, slots: Iterable[int], *, point: Point | None = None, target: int = NO_TAG, queue: bool = False
) -> list[int]:
    """Right-click: do what the skills make of it, else what ``commands`` does; return the slots that took it."""
    rest = list(slots)
    taken = list[int]()
    victim = world.slot_of(target)
    for rule in SMARTS:
        some = rule(world, rest, victim, point, queue)
        taken += some
        rest = [slot for slot in rest if slot not in some]
    return taken + commands.smart(world, rest, point=point, target=target, queue=queue)


def _busy(world: World, cast: Cast) -> bool:
    """Return whether the unit already uses this very ability; other units are asked first."""
    return bool(world.casts[cast.slot]) and int(world.order_ability[cast.slot]) == cast.ability.id


def _away(world: World, cast: Cast) -> float:
    """Return the key by which a caster is chosen, smallest first: its distance, or its energy where there is none."""
    distance = _distance(world, cast)
    return -float(world.energy[cast.slot]) if distance is None else distance


def perform(world: World, cast: Cast) -> None:
    """Charge the cost, start the cooldown and make the ability take effect."""
    slot, ability = cast.slot, cast.ability
    player = world.players[int(world.owner[slot])]
    payments.charge(world, player.id, prices.cost_of(ability))
    if "free" not in player.cheats:
        world.energy[slot] = max(0.0, float(world.energy[slot]) - ability.energy)
        world.life[slot] -= ability.life
    start_cooldown(world, slot, ability)
    SKILLS[ability.effect].effect(world, cast)


def start_cooldown(world: World, slot: int, ability: Ability, loops: float | None = None) -> None:
    """Start the ability's cooldown now, for ``loops`` or for as long as the tables say."""
    lasts = ability.cooldown_loops if loops is None else loops
    if lasts:
        shared = world.players[int(world.owner[slot])].timers
        timers = shared if ability.cooldown_shared else world.timers.setdefault(slot, {})
        timers[ability.timer] = world.loop + lasts


def skill_of(ability: Ability) -> Skill:
    """Return the rule behind an ability; raise ``KeyError`` for one that is not modelled."""
    return SKILLS[ability.effect]


def fail(world: World, cast: Cast, why: ActionResult) -> None:
    """Tell a player that an order could not be carried out after all."""
    owner = int(world.owner[cast.slot])
    world.mishaps.append(Mishap(world.loop, owner, world.tag_of(cast.slot), cast.ability.id, why))
