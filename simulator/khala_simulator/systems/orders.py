"""Orders: when the current one is finished, the next in the queue begins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.movement import arrival
from khala_simulator.movement.arrival import ArrivalCrowd
from khala_simulator.native import columns
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

CROWD_PERIOD: Final = 2
"""How often the density of the crowd at a goal is checked; units that look for targets check after each look."""
CROWD_STALL: Final = MECHANICS.crowd_stall
SCAN_PERIOD: Final = MECHANICS.scan_period
ATTACK_MOVE: Final = int(OrderKind.ATTACK_MOVE)
IDLE: Final = int(OrderKind.IDLE)
ARRIVAL_RADIUS_SQUARED: Final = MECHANICS.arrival_radius**2


def carry_out(world: World) -> None:
    """End every order whose point is reached or whose target is gone, and begin the next one."""
    c = columns.columns_of(world)
    finished = _find_lost(world, c)
    _find_arrived(world, c, finished)
    for slot in finished:
        fought = c.order_kind[slot] == ATTACK_MOVE
        commands.begin_next(world, slot)
        c.on_guard[slot] = fought and c.order_kind[slot] == IDLE


def _find_lost(world: World, c: Columns) -> list[int]:
    """Return slots whose target is dead or out of their owner's sight; where nothing hides only a change does that."""
    if not (world.orders_changed or world.fog or world.hiding):
        return []
    world.orders_changed = False
    return [slot for slot in range(world.top) if c.needs_target[slot] and _is_lost(c, slot)]


def _is_lost(c: Columns, slot: int) -> bool:
    """Return whether the target of a unit's order is dead or out of its owner's sight."""
    target = c.order_target[slot]
    return target == NOBODY or not c.visible[c.owner[slot] * c.capacity + target]


def _find_arrived(world: World, c: Columns, found: list[int]) -> None:
    """Add slots whose walk has reached its point, or as near as the crowd there or the terrain allows."""
    loop = world.loop
    just_looked = loop % SCAN_PERIOD == 1
    looks_at_crowds = just_looked or loop % CROWD_PERIOD == 0
    crowd = None
    for slot in range(world.top):
        if not c.walks[slot]:
            continue
        if c.looks_around[slot] and _goes_on(c, slot, just_looked and c.scan_loop[slot] > loop):
            continue
        if _is_there(c, slot):
            found.append(slot)
        elif looks_at_crowds and (c.blocked[slot] > 0 or loop - c.nav_best_loop[slot] > CROWD_STALL):
            if crowd is None:
                crowd = ArrivalCrowd(world)
            if arrival.is_packed(c, crowd, slot):
                found.append(slot)


def _goes_on(c: Columns, slot: int, just_looked: bool) -> bool:
    """Return whether a unit that looks for targets on its way goes on: it has one, or has not just looked in vain.

    If it ended without that look, an attack on a place would end as soon as the first enemy there is dead.
    """
    return c.target[slot] != NOBODY or (c.acquires[slot] and not just_looked)


def _is_there(c: Columns, slot: int) -> bool:
    """Return whether a walker has reached its point, or the end of its way."""
    x = c.order_point[slot].x - c.pos[slot].x
    y = c.order_point[slot].y - c.pos[slot].y
    return x * x + y * y <= ARRIVAL_RADIUS_SQUARED or c.nav_end[slot]
