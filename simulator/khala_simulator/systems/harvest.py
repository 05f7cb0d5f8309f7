"""Harvesting: workers take from their resources, deliver their loads, and change to another field when theirs is taken.

``harvesting`` defines a round; ``engagement`` and ``movement`` have the way. A mineral field has room for one worker at
a time, except for those whose ability ``shares_patch``; in a gas structure one is out of sight while it works. How
workers choose between fields is an estimate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.combat import lifecycle
from khala_simulator.economy import harvesting
from khala_simulator.economy.harvesting import ORDINARY_TRIP, Phase
from khala_simulator.native import columns
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.world import Death

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

NONE: Final = int(Phase.NONE)
TO_RESOURCE: Final = int(Phase.TO_RESOURCE)
TO_HALL: Final = int(Phase.TO_HALL)
NO_KILLER: Final = -1
REMEMBERED_LOOPS: Final = 240  # how long deliveries count for the rate of collection
RETRY_LOOPS: Final = 8  # how often a worker before a taken field looks for another one


def run(world: World) -> None:
    """Lead every worker that harvests through its round by one loop."""
    if not world.harvesting:
        return
    c = columns.columns_of(world)
    loop = world.loop
    harvests = False
    due = []
    for slot in range(world.top):
        if c.harvest[slot] != NONE:
            harvests = True
            if _is_due(c, slot, loop):
                due.append(slot)
    world.harvesting = harvests
    for slot in due:
        STEPS[int(world.harvest[slot])](world, slot)


def _is_due(c: Columns, slot: int, loop: int) -> bool:
    """Return whether a worker has come to the end of its phase."""
    if c.harvest[slot] == TO_RESOURCE or c.harvest[slot] == TO_HALL:
        return not c.wants[slot] and bool(c.can_act[slot])  # as ``engagement`` measured it
    return bool(c.work_until[slot] <= loop)


def _arrive(world: World, slot: int) -> None:
    """Make a worker at its resource begin, wait, or look for another one."""
    patch = int(world.order_target[slot])
    if patch == NOBODY or not harvesting.can_harvest(world, slot, patch) or world.contents[patch] <= 0:
        _look_elsewhere(world, slot)
    elif _has_room(world, slot, patch):
        _begin(world, slot, patch)
    elif _is_field(world, patch) and world.work_until[slot] <= world.loop:
        world.work_until[slot] = world.loop + RETRY_LOOPS
        other = harvesting.another_field(world, slot, world.pos[patch], waiting=patch)
        if other != NOBODY:
            harvesting.head_for_resource(world, slot, other)


def _look_elsewhere(world: World, slot: int) -> None:
    """Go to another field near the one that is gone; without one the order ends."""
    other = harvesting.another_field(world, slot, world.pos[slot])
    if other != NOBODY:
        harvesting.head_for_resource(world, slot, other)
    elif not (world.load[slot] and harvesting.head_for_hall(world, slot)):
        commands.begin_next(world, slot)


def _is_field(world: World, patch: int) -> bool:
    return bool(harvesting.kinds(world.catalog)[1][int(world.type[patch])])


def _numbers(world: World, slot: int) -> dict[str, float]:
    gather = harvesting.harvesters(world.catalog)[int(world.type[slot])][0]
    return gather.numbers if gather is not None else {}


def _has_room(world: World, slot: int, patch: int) -> bool:
    free = world.occupant[patch] == NOBODY and world.work_until[patch] <= world.loop
    return bool(free or _numbers(world, slot).get("shares_patch"))


def _begin(world: World, slot: int, patch: int) -> None:
    numbers = _numbers(world, slot)
    if not numbers.get("shares_patch"):
        world.occupant[patch] = slot
    world.harvest[slot] = Phase.AT_RESOURCE
    world.work_until[slot] = world.loop + world.unit_type(patch).harvest_loops * numbers.get("time_factor", 1.0)
    if not _is_field(world, patch):
        lifecycle.stow(world, slot, patch)
        world.order_target[slot] = patch


def _take(world: World, slot: int) -> None:
    """Give the worker its load at the end of the resource's time, and make room for the next worker."""
    patch = int(world.patch[slot])
    harvesting.leave(world, slot)
    if patch == NOBODY:
        _look_elsewhere(world, slot)
        return
    unit = world.unit_type(patch)
    trip = int(unit.per_trip * _numbers(world, slot).get("trip_factor", 1))
    amount = min(trip, int(world.contents[patch]))
    gas = not _is_field(world, patch)
    if amount:
        world.contents[patch] -= amount
        geyser = int(world.patch[patch])
        if geyser != NOBODY:
            world.contents[geyser] = world.contents[patch]
        harvesting.take_up(world, slot, amount, gas=gas, rich=unit.per_trip > ORDINARY_TRIP)
    world.harvest[slot] = Phase.LEAVING
    world.work_until[slot] = world.loop + MECHANICS.harvest_leaving
    if amount and world.contents[patch] <= 0:
        world.alert(int(world.owner[slot]), "VespeneExhausted" if gas else "MineralsExhausted")
    if world.contents[patch] <= 0 and not gas:
        world.deaths.append(Death(world.loop, world.tag_of(patch), unit.id, int(world.owner[patch]), NO_KILLER))
        lifecycle.remove(world, patch)


def _go_home(world: World, slot: int) -> None:
    if not world.load[slot]:
        _look_elsewhere(world, slot)
    elif not harvesting.head_for_hall(world, slot):
        commands.begin_next(world, slot)


def _drop_off(world: World, slot: int) -> None:
    """Deliver the load; a worker with another order begins it, the others go back to their resource."""
    hall = int(world.order_target[slot])
    if hall == NOBODY or world.build_progress[hall] < 1.0:
        _go_home(world, slot)
        return
    deliver(world, slot)
    patch = int(world.patch[slot])
    if world.queue[slot]:
        commands.begin_next(world, slot)
    elif patch != NOBODY and world.contents[patch] > 0:
        harvesting.head_for_resource(world, slot, patch)
    else:
        _look_elsewhere(world, slot)


def deliver(world: World, slot: int) -> None:
    """Add a worker's load to its owner's resources."""
    player = world.players[int(world.owner[slot])]
    amount = float(world.load[slot])
    gas = harvesting.carries_gas(world, slot)
    minerals, vespene = (0.0, amount) if gas else (amount, 0.0)
    player.minerals += minerals
    player.vespene += vespene
    score = player.score
    score.collected[0] += minerals
    score.collected[1] += vespene
    score.deliveries.append((world.loop, minerals, vespene))
    while score.deliveries[0][0] <= world.loop - REMEMBERED_LOOPS:
        score.deliveries.pop(0)
    harvesting.put_down(world, slot)


STEPS: Final = {
    int(Phase.TO_RESOURCE): _arrive,
    int(Phase.AT_RESOURCE): _take,
    int(Phase.LEAVING): _go_home,
    int(Phase.TO_HALL): _drop_off,
}
