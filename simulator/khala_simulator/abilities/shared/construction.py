"""Skills of builders: placing a structure, going on with one, halting, and calling one off.

A Probe goes as soon as the structure is placed, a Drone becomes it, an SCV stays until it is done.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared.production import MORPHS
from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import lifecycle
from khala_simulator.economy import building_sites, construction, payments, production
from khala_simulator.tables import prices
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World


IN_PROGRESS: Final = frozenset({"BuildInProgress", "BuildinProgressNydusCanal", "Warpable"})
"""The groups of abilities by which an unfinished structure or unit calls itself off."""


# placing --------------------------------------------------------------------------------------------------------------


def _place(world: World, cast: Cast) -> None:
    """Begin a structure at the point of the cast."""
    unit = building_sites.product(world, cast.ability)
    slot = cast.slot
    if unit is None:
        return
    owner = int(world.owner[slot])
    race = world.unit_type(slot).race
    paid = (0.0, 0.0) if "free" in world.players[owner].cheats else prices.cost_of(cast.ability)
    geyser = cast.target
    if geyser != NOBODY:
        unit = _rich(world, unit, geyser)
    point = _where(world, cast, unit)
    if race == "zerg":
        lifecycle.remove(world, slot)
    made = construction.begin(
        world, unit, owner, point, loops=cast.ability.loops, paid=paid, by_itself=race != "terran"
    )
    if geyser != NOBODY:
        world.occupant[geyser], world.patch[made] = made, geyser
        world.contents[made] = world.contents[geyser]
    if race == "terran":
        order = Order(OrderKind.FOLLOW, cast.ability.id, target=world.tag_of(made))
        commands.begin(world, slot, order)


def _rich(world: World, unit: UnitType, geyser: int) -> UnitType:
    """Return the kind of gas structure that stands on a rich geyser."""
    name = f"{unit.name}Rich"
    rich = world.unit_type(geyser).per_trip > unit.per_trip and name in world.catalog.row_of_name
    return world.catalog.unit(name) if rich else unit


def _where(world: World, cast: Cast, unit: UnitType) -> Point:
    if cast.target != NOBODY:
        x, y = world.pos[cast.target].tolist()
        return x, y
    assert cast.point is not None
    return building_sites.centre(world, unit, cast.point)


def _can_place(world: World, cast: Cast) -> ActionResult:
    unit = building_sites.product(world, cast.ability)
    if unit is None:
        return ActionResult.NOT_SUPPORTED
    owner = int(world.owner[cast.slot])
    if cast.target != NOBODY:
        free = building_sites.is_free_geyser(world, cast.target)
        return ActionResult.SUCCESS if free else ActionResult.CANT_BUILD_ON_THAT
    if cast.point is None:
        return ActionResult.CANT_FIND_PLACEMENT_LOCATION
    return building_sites.refusal(world, owner, unit, cast.point, on_site=cast.is_carried_out)


def _is_known(world: World, _: int, ability: Ability) -> ActionResult:
    known = bool(ability.loops) and building_sites.product(world, ability) is not None
    return ActionResult.SUCCESS if known else ActionResult.NOT_SUPPORTED


def _summon(world: World, slots: list[int], ability: Ability, _: int, point: Point | None, __: bool) -> list[int]:
    """Begin a structure far away, as a Nydus Network does with its worms."""
    unit = building_sites.product(world, ability)
    if unit is None or point is None:
        return []
    owner = int(world.owner[slots[0]])
    if building_sites.refusal(world, owner, unit, point, on_site=True) is not ActionResult.SUCCESS:
        return []
    paid = payments.charge(world, owner, prices.cost_of(ability))
    construction.begin(world, unit, owner, building_sites.centre(world, unit, point), loops=ability.loops, paid=paid)
    world.timers.setdefault(slots[0], {})[ability.timer] = world.loop + ability.cooldown_loops
    return slots[:1]


# going on and halting -------------------------------------------------------------------------------------------------


def resume(world: World, slots: list[int], target: int, _: Point | None, queue: bool) -> list[int]:
    """Right-click an unfinished structure with a Terran builder: go on with it."""
    unit = world.unit_type(target) if target != NOBODY else None
    if unit is None or world.build_progress[target] >= 1.0 or world.self_made[target]:
        return []
    way = next((way for way in unit.made_by if way.kind == "build"), None)
    taken: list[int] = []
    for slot in slots:
        mine = world.owner[slot] == world.owner[target]
        if way is not None and mine and world.unit_type(slot).name == way.producer:
            order = Order(OrderKind.FOLLOW, way.ability, target=world.tag_of(target))
            taken += commands.give(world, [slot], order, queue=queue)
    return taken


def _halt(world: World, slots: list[int], _: Ability, __: int, ___: Point | None, ____: bool) -> list[int]:
    """Send the builder of a structure, or a builder itself, away from the work."""
    for slot in slots:
        builder = slot if world.unit_type(slot).worker else construction.builder_of(world, slot)
        if builder != NOBODY:
            world.site[builder] = NOBODY
            commands.stop(world, [builder])
    return slots


def _is_at_work(world: World, slot: int, _: Ability) -> ActionResult:
    busy = world.site[slot] != NOBODY or construction.builder_of(world, slot) != NOBODY
    return ActionResult.SUCCESS if busy else ActionResult.CANT_FIND_CANCEL_ORDER


# calling off ----------------------------------------------------------------------------------------------------------


def _cancel(world: World, slots: list[int], _: Ability, __: int, ___: Point | None, ____: bool) -> list[int]:
    """Call off a construction, a structure's change of kind or its add-on, or a pending mode change."""
    for slot in slots:
        if world.build_progress[slot] < 1.0:
            construction.call_off(world, slot)
        elif slot in world.jobs:
            _cancel_change(world, slot)
        else:
            world.bound[slot] = False
            commands.begin_next(world, slot)
    return slots


def _cancel_change(world: World, slot: int) -> None:
    site = world.slot_of(world.jobs[slot][-1].site)
    production.call_off(world, slot)
    if site != NOBODY:
        construction.call_off(world, site)


def _has_something(world: World, slot: int, ability: Ability) -> ActionResult:
    """Refuse if there is nothing of this kind to call off."""
    if world.build_progress[slot] < 1.0:
        return ActionResult.SUCCESS if ability.link in IN_PROGRESS else ActionResult.CANT_FIND_CANCEL_ORDER
    if ability.link in IN_PROGRESS:
        return ActionResult.CANT_FIND_CANCEL_ORDER
    jobs = world.jobs.get(slot, [])
    if jobs:
        begun = world.catalog.ability(jobs[-1].ability)
        fits = jobs[-1].kind in MORPHS and begun.link in (ability.link, "")
        return ActionResult.SUCCESS if fits else ActionResult.CANT_FIND_CANCEL_ORDER
    if world.casts[slot] and world.bound[slot]:
        begun = world.catalog.ability(int(world.order_ability[slot]))
        return ActionResult.SUCCESS if begun.link == ability.link else ActionResult.CANT_FIND_CANCEL_ORDER
    return ActionResult.CANT_FIND_CANCEL_ORDER


SMARTS: Final = (resume,)
SKILLS: Final = {
    "build": Skill(
        _place,
        refuse=_can_place,
        ready=_is_known,
        estimates=("A builder places a structure as soon as it touches it.", "Units of others keep one from placing."),
    ),
    "summon": Skill(give=_summon, refuse=_can_place, ready=_is_known),
    "halt": Skill(give=_halt, ready=_is_at_work, anytime=True),
    "cancel": Skill(give=_cancel, ready=_has_something, anytime=True),
}
