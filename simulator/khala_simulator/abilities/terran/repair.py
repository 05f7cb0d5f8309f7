"""Repair: SCVs and MULEs repair machines and structures for a quarter of their price.

One worker repairs a whole unit in the time that the tables give; several add up. Every loop costs its share of the
price, and a player who can't pay it stops the work.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.skill import Skill, distance, nearest_hurt, number, touching
from khala_simulator.abilities.terran.medivacs import resume
from khala_simulator.combat.healing import heal, is_hurt
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.stats import ATTRIBUTES
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import SmartRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

REPAIRS: Final = ("repair", "mule_repair")
MECHANICAL: Final = 1 << ATTRIBUTES.index("mechanical")


def _can_repair(world: World, cast: Cast) -> ActionResult:
    target = cast.target
    if target == NOBODY:
        return ActionResult.MUST_TARGET_UNIT
    if not is_hurt(world, target) or _loops(world, target) <= 0.0:
        return ActionResult.REQUIRES_REPAIR_TARGET
    return _unaffordable(world, cast)


def _unaffordable(world: World, cast: Cast) -> ActionResult:
    """Refuse if the player can't afford the next loop of work."""
    player = world.players[int(world.owner[cast.slot])]
    if "free" in player.cheats:
        return ActionResult.SUCCESS
    minerals, vespene = _price(world, cast)
    if player.minerals < minerals:
        return ActionResult.NOT_ENOUGH_MINERALS
    return ActionResult.NOT_ENOUGH_VESPENE if player.vespene < vespene else ActionResult.SUCCESS


def _loops(world: World, slot: int) -> float:
    """Return the loops that one worker needs to repair a unit from zero life."""
    return world.unit_type(slot).repair_loops


def _price(world: World, cast: Cast) -> tuple[float, float]:
    """Return the minerals and vespene for one loop of work."""
    share = number(cast, "cost_fraction_full_repair") / _loops(world, cast.target)
    minerals, vespene = world.unit_type(cast.target).cost
    return minerals * share, vespene * share


def _mend(world: World, cast: Cast) -> bool:
    """Repair for one loop; follow a unit that moves away, stop when it has full life or the resources are used up."""
    slot, target = cast.slot, cast.target
    if target == NOBODY or not world.targetable[target] or not is_hurt(world, target):
        return False
    x, y = world.pos[target].tolist()
    if distance(world, slot, (x, y)) > touching(world, slot, target) + 2.0 * cast.ability.slop:
        resume(world, slot)
        return True
    if _unaffordable(world, cast) is not ActionResult.SUCCESS:
        return False
    whole = float(world.life_max[target]) / _loops(world, target)
    mended = heal(world, target, whole)
    player = world.players[int(world.owner[slot])]
    if "free" not in player.cheats:
        minerals, vespene = _price(world, cast)
        player.minerals -= minerals * mended / whole
        player.vespene -= vespene * mended / whole
    return is_hurt(world, target)


def _begin(world: World, cast: Cast) -> None:
    """Repair a machine or a structure, loop by loop, for a quarter of its price and in its production time."""
    _mend(world, cast)


def _pick(world: World, slot: int, ability: Ability) -> int:
    """Return the nearest machine or structure of the owner's that needs repair."""
    return next(iter(nearest_hurt(world, slot, ability.autocast_range, MECHANICAL)), NOBODY)


def _repair_by_click(world: World, slots: list[int], target: int, _: Point | None, queue: bool) -> list[int]:
    """Send workers that right-click on a damaged machine or structure of their own to repair it."""
    if target == NOBODY or "mechanical" not in world.unit_type(target).attributes:
        return []
    if world.build_progress[target] < 1.0 or not is_hurt(world, target):
        return []
    taken: list[int] = []
    for slot in slots:
        card = world.catalog.abilities_of(int(world.type[slot]))
        ability = next((a for a in card if a.effect in REPAIRS), None)
        if ability is not None and slot != target and world.owner[slot] == world.owner[target]:
            order = Order(OrderKind.CAST, ability.id, target=world.tag_of(target))
            taken += commands.give(world, [slot], order, queue=queue)
    return taken


SMARTS: Final[tuple[SmartRule, ...]] = (_repair_by_click,)
SKILLS: Final = {
    name: Skill(
        _begin,
        refuse=_can_repair,
        hold=_mend,
        pick=_pick,
        estimates=("Repair is given and paid for evenly in every loop; the game's rounding is not known.",),
    )
    for name in REPAIRS
}
