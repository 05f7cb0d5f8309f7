"""Transports of all races: loading, unloading, the fate of passengers, and the right click on a carrier.

The tables hold which types carry, how much, how far they reach and how fast they unload (``cargo_`` of a unit type). A
mobile carrier goes to its passenger. Passengers go to one that stands still: they follow it with the load ability as
their order and get in when they are beside it. Unloading goes on by itself, a unit per period, until the carrier is
empty; meanwhile the carrier may move. A unit in a Bunker keeps a weapon (``traits`` gives it the Bunker's edge and one
more range). All Nydus entrances of a player share what is inside.

Above: ``casting`` and ``systems.passives``. Below: ``teleport`` for where a unit fits.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, gap
from khala_simulator.combat import lifecycle
from khala_simulator.combat.traits import kinds_on, refresh
from khala_simulator.movement import placement
from khala_simulator.numeric.arrays import which
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.abilities.skill import SmartRule, UnitRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

FOLLOW = int(OrderKind.FOLLOW)
BOARDING_GAP = 1.1  # a follower stops within this distance of the unit that it follows
UNLOAD_REACH = 4.0  # MaxUnloadRange of the Nydus network; the others have none of their own
UNLOADING = "unloading"
NYDUS: Final = frozenset({"NydusNetwork", "NydusCanal"})
CARRIERS: Final = (
    "Medivac", "WarpPrism", "WarpPrismPhasing", "OverlordTransport", "Bunker", "CommandCenter", "CommandCenterFlying",
    "PlanetaryFortress", "NydusNetwork", "NydusCanal",
)  # fmt: skip
SPILLS: Final = frozenset({"Bunker", "CommandCenter", "CommandCenterFlying", "PlanetaryFortress"})
"""Carriers whose passengers survive them; passengers of other carriers die with them (the catalog's CargoDeath)."""
WORKERS_ONLY: Final = frozenset({"CommandCenter", "CommandCenterFlying", "PlanetaryFortress"})


# what fits ------------------------------------------------------------------------------------------------------------


def inside(world: World, carrier: int) -> list[int]:
    """Return the units in a carrier; all Nydus entrances of a player hold the same ones."""
    if world.unit_type(carrier).name not in NYDUS:
        return world.passengers(carrier)
    owner = int(world.owner[carrier])
    return [s for other in _entrances(world, owner) for s in world.passengers(other)]


def _entrances(world: World, owner: int) -> list[int]:
    return [slot for slot in world.units_of(owner).tolist() if world.unit_type(slot).name in NYDUS]


def room(world: World, carrier: int) -> int:
    """Return the free cargo space of a carrier."""
    taken = sum(world.unit_type(slot).cargo_size for slot in inside(world, carrier))
    return world.unit_type(carrier).cargo_space - taken


def cant_carry(world: World, carrier: int, passenger: int) -> ActionResult:
    """Return why a carrier can't take a unit in now, ``ActionResult.SUCCESS`` when it can."""
    unit, vessel = world.unit_type(passenger), world.unit_type(carrier)
    if world.owner[passenger] != world.owner[carrier]:
        return ActionResult.CANT_LOAD_OTHER_PLAYERS_UNITS
    bound = any("no_passenger" in kind.flags for kind in kinds_on(world, passenger))
    alien = vessel.name in WORKERS_ONLY and not unit.worker
    alien |= vessel.name == "Bunker" and "biological" not in unit.attributes
    if not unit.cargo_size or unit.cargo_size > vessel.cargo_max_size or bound or alien or passenger == carrier:
        return ActionResult.CANT_LOAD_THAT_UNIT
    if world.build_progress[carrier] < 1.0 or world.hallucination[carrier] or world.hallucination[passenger]:
        return ActionResult.CANT_LOAD_THAT_UNIT
    return (
        ActionResult.SUCCESS if unit.cargo_size <= room(world, carrier) else ActionResult.NOT_ENOUGH_ROOM_TO_LOAD_UNIT
    )


# in -------------------------------------------------------------------------------------------------------------------


def _load(world: World, cast: Cast) -> None:
    """Load a unit that has come within reach."""
    if cant_carry(world, cast.slot, cast.target) is ActionResult.SUCCESS:
        take_in(world, cast.slot, cast.target)


def take_in(world: World, carrier: int, passenger: int) -> None:
    """Put a unit into a carrier at once; it drops its orders."""
    world.queue[passenger] = []
    commands.begin(world, passenger, None)
    lifecycle.stow(world, passenger, carrier)
    x, y = world.pos[carrier].tolist()
    teleport.to(world, passenger, (x, y))
    refresh(world, passenger)
    if world.unit_type(carrier).name == "Bunker":
        world.holds[passenger] = world.looks_around[passenger] = True
    world.timers.get(carrier, {}).pop(UNLOADING, None)


def _order_to_load(
    world: World, slots: list[int], ability: Ability, target: int, point: Point | None, queue: bool
) -> list[int]:  # fmt: skip
    """Send the nearest carrier with room, or to one that can't move its passenger."""
    del point
    passenger = world.slot_of(target)
    carrier = min(slots, key=lambda slot: (gap(world, slot, passenger), slot))
    if world.step_max[carrier] > 0.0:
        return commands.give(world, [carrier], Order(OrderKind.CAST, ability.id, target=target), queue=queue)
    _board(world, [passenger], carrier, ability, queue=queue)
    return [carrier]


def _board(world: World, slots: list[int], carrier: int, ability: Ability, *, queue: bool) -> list[int]:
    """Make units walk to a carrier and get in."""
    order = Order(OrderKind.FOLLOW, ability.id, target=world.tag_of(carrier))
    return commands.give(world, slots, order, queue=queue)


def _cant_load(world: World, cast: Cast) -> ActionResult:
    if cast.target == NOBODY:
        return ActionResult.MUST_TARGET_UNIT
    return cant_carry(world, cast.slot, cast.target)


def _load_all(world: World, cast: Cast) -> None:
    """Call the nearest workers, as many as there is room for."""
    for slot in _callable(world, cast)[: room(world, cast.slot)]:
        _board(world, [slot], cast.slot, cast.ability, queue=False)


def _callable(world: World, cast: Cast) -> list[int]:
    mine = world.units_of(int(world.owner[cast.slot])).tolist()
    fit = [slot for slot in mine if cant_carry(world, cast.slot, slot) is ActionResult.SUCCESS]
    return sorted(fit, key=lambda slot: (gap(world, cast.slot, slot), slot))


def _nobody_to_load(world: World, cast: Cast) -> ActionResult:
    return ActionResult.SUCCESS if _callable(world, cast) else ActionResult.LOAD_ALL_NO_TARGETS_FOUND


# out ------------------------------------------------------------------------------------------------------------------


def _unload_all(world: World, cast: Cast) -> None:
    """Begin to unload every passenger, one after the other."""
    world.timers.setdefault(cast.slot, {})[UNLOADING] = world.loop


def _unload_there(world: World, cast: Cast) -> bool:
    """Stay at the place until every passenger is out; a carrier that unloads at itself goes on with its order."""
    return UNLOADING in world.timers.get(cast.slot, {}) and cast.target != cast.slot


def _order_to_unload(
    world: World, slots: list[int], ability: Ability, target: int, point: Point | None, queue: bool
) -> list[int]:  # fmt: skip
    """Unload on the way if the target is the carrier itself, else at the point or beside the unit."""
    own = world.slot_of(target)
    if own in slots and not queue:
        world.timers.setdefault(own, {})[UNLOADING] = world.loop
    rest = [slot for slot in slots if slot != own]
    order = Order(OrderKind.CAST, ability.id, target=target, point=None if target else point)
    return ([own] if own in slots else []) + commands.give(world, rest, order, queue=queue)


def _no_place(world: World, cast: Cast) -> ActionResult:
    """Refuse if no unit could stand at the named point."""
    if cast.point is None or cast.target != NOBODY:
        return ActionResult.SUCCESS
    unit = world.unit_type(inside(world, cast.slot)[0])
    reach = UNLOAD_REACH + float(world.radius[cast.slot])
    free = len(placement.candidates(world, unit, cast.point, reach)) > 0
    return ActionResult.SUCCESS if free else ActionResult.CANT_UNLOAD_UNITS_THERE


def _is_empty(world: World, slot: int, _: Ability) -> ActionResult:
    return ActionResult.SUCCESS if inside(world, slot) else ActionResult.NO_CARGO_TO_UNLOAD


def unload_passenger(world: World, carrier: int, passenger: int) -> bool:
    """Unload one unit from a carrier now; return whether there was a place for it."""
    x, y = world.pos[carrier].tolist()
    unit = world.unit_type(passenger)
    places = placement.candidates(world, unit, (x, y), UNLOAD_REACH + float(world.radius[carrier]))
    if not len(places):
        return False
    px, py = places[0].tolist()
    lifecycle.unstow(world, passenger, (px, py))
    teleport.to(world, passenger, (px, py))
    refresh(world, passenger)
    commands.begin(world, passenger, None)
    return True


def _unload_unit(world: World, cast: Cast) -> None:
    """Unload the named passenger, or the first one."""
    found = inside(world, cast.slot)
    if found:
        unload_passenger(world, cast.slot, cast.target if cast.target in found else found[0])


# in every loop --------------------------------------------------------------------------------------------------------


def _carry(world: World, slots: list[int]) -> None:
    """Load the units beside the carrier that want in, and unload those that are due."""
    following = world.order_kind[: world.top] == FOLLOW
    if np.count_nonzero(following):
        for slot in which(following).tolist():
            carrier = int(world.order_target[slot])
            if carrier in slots and _boards(world, slot, carrier):
                _let_in(world, slot, carrier)
    for carrier in slots:
        timers = world.timers.get(carrier)
        if timers and timers.get(UNLOADING, math.inf) <= world.loop:
            _let_out(world, carrier)


def _boards(world: World, slot: int, carrier: int) -> bool:
    ability = world.catalog.ability(int(world.order_ability[slot]))
    reach = max(world.unit_type(carrier).cargo_range, BOARDING_GAP)
    return ability.effect in ("load", "load_all") and gap(world, slot, carrier) <= reach


def _let_in(world: World, slot: int, carrier: int) -> None:
    why = cant_carry(world, carrier, slot)
    if why is ActionResult.SUCCESS:
        take_in(world, carrier, slot)
    elif why is not ActionResult.NOT_ENOUGH_ROOM_TO_LOAD_UNIT or not world.queue[slot]:
        commands.begin_next(world, slot)


def _let_out(world: World, carrier: int) -> None:
    """Unload the next passenger, or all at once where there is no period."""
    period = world.unit_type(carrier).unload_period_n * LOOPS_PER_NORMAL_SECOND
    timers = world.timers[carrier]
    for passenger in inside(world, carrier):
        if not unload_passenger(world, carrier, passenger):
            timers[UNLOADING] = world.loop + 1
            return
        if period:
            break
    if inside(world, carrier):
        timers[UNLOADING] = world.loop + period
    else:
        timers.pop(UNLOADING, None)


# death ----------------------------------------------------------------------------------------------------------------


def _spill(world: World, slot: int) -> None:
    """Put every passenger beside a carrier that dies."""
    for passenger in world.passengers(slot):
        if not unload_passenger(world, slot, passenger):
            x, y = world.pos[slot].tolist()
            lifecycle.unstow(world, passenger, (x, y))


def _hand_on(world: World, slot: int) -> None:
    """Hand the units in a Nydus entrance that dies to another entrance; without one they die, too."""
    others = [other for other in _entrances(world, int(world.owner[slot])) if other != slot]
    others = [other for other in others if world.life[other] > 0.0 and world.build_progress[other] >= 1.0]
    if others:
        for passenger in world.passengers(slot):
            world.carrier[passenger] = others[0]


# the right click ------------------------------------------------------------------------------------------------------


def load_by_click(
    world: World, slots: list[int], target: int, point: Point | None, queue: bool
) -> list[int]:  # fmt: skip
    """Make units that click on a carrier of their own get in, and a carrier that clicks on such a unit load it."""
    del point
    if target == NOBODY or world.carrier[target] != NOBODY:
        return []
    load = _load_ability(world, target)
    if load is not None:
        slots = [slot for slot in slots if _may_board(world, slot, target)]
        return _board(world, slots, target, load, queue=queue)
    taken: list[int] = []
    for slot in slots:
        own = _load_ability(world, slot)
        if own is not None and world.step_max[slot] > 0.0 and cant_carry(world, slot, target) is ActionResult.SUCCESS:
            order = Order(OrderKind.CAST, own.id, target=world.tag_of(target))
            taken += commands.give(world, [slot], order, queue=queue)
    return taken


def _may_board(world: World, slot: int, carrier: int) -> bool:
    """Return whether a unit would get in; workers rather repair a damaged carrier."""
    damaged = world.unit_type(slot).worker and world.life[carrier] < world.life_max[carrier]
    return not damaged and cant_carry(world, carrier, slot) is ActionResult.SUCCESS


def _load_ability(world: World, slot: int) -> Ability | None:
    card = world.catalog.abilities_of(int(world.type[slot]))
    return next((ability for ability in card if ability.effect == "load"), None)


SKILLS: Final = {
    "load": Skill(
        _load,
        give=_order_to_load,
        refuse=_cant_load,
        estimates=(
            "A unit that walks to a carrier gets in when it is within 1.1 of it, or within its pickup range.",
            "Loading takes no time, and the first passenger comes out at once; then one per period.",
        ),
    ),
    "load_all": Skill(_load_all, refuse=_nobody_to_load),
    "unload_all": Skill(_unload_all, ready=_is_empty),
    "unload_all_at": Skill(_unload_all, give=_order_to_unload, refuse=_no_place, ready=_is_empty, hold=_unload_there),
    "unload_unit": Skill(_unload_unit, ready=_is_empty),
}
PASSIVES: Final[dict[str, UnitRule]] = dict.fromkeys(CARRIERS, _carry)
DEATHS: Final[dict[str, Callable[[World, int], None]]] = {
    **dict.fromkeys(SPILLS, _spill),
    **dict.fromkeys(NYDUS, _hand_on),
}
SMARTS: Final[tuple[SmartRule, ...]] = (load_by_click,)
