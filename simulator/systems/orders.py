"""Orders: when the current one is finished, the next in the queue begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator import commands
from simulator.mechanics import MECHANICS
from simulator.orders import Order, OrderKind
from simulator.world import NO_TAG, NOBODY, Bools, Ints

if TYPE_CHECKING:
    from simulator.world import World

WALKS = (OrderKind.MOVE, OrderKind.ATTACK_MOVE, OrderKind.SCAN_MOVE, OrderKind.PATROL)
PACKED_AFTER_LOOPS = 5


def carry_out(world: World) -> None:
    """End every order whose point is reached or whose target is gone, and begin what waits behind it."""
    n = world.top
    kind = world.order_kind[:n]
    if not kind.any():
        return
    lost = (world.order_target[:n] == NOBODY) & ((kind == OrderKind.ATTACK_UNIT) | (kind == OrderKind.FOLLOW))
    finished: Ints = np.flatnonzero(lost | _arrived(world))
    for slot in finished.tolist():
        _next(world, slot)


def _arrived(world: World) -> Bools:
    """(top,) walks that have reached their point, or as near as the crowd there lets them."""
    n = world.top
    kind = world.order_kind[:n]
    walking = np.isin(kind, WALKS) & (world.target[:n] == NOBODY)
    if not walking.any():
        return np.zeros(n, dtype=np.bool_)
    offset = world.order_point[:n] - world.pos[:n]
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    arrived: Bools = walking & ((distance <= MECHANICS.arrival_radius) | world.nav_end[:n])
    stuck = np.flatnonzero(walking & ~arrived & (world.blocked[:n] >= PACKED_AFTER_LOOPS))
    for slot in stuck.tolist():
        arrived[slot] = _packed(world, slot, float(distance[slot]))
    return arrived


def _packed(world: World, slot: int, distance: float) -> bool:
    """Whether friends' bodies fill the ground between a blocked unit and its goal."""
    friends = world.units_of(int(world.owner[slot]))
    friends = friends[(world.layer_bits[friends] & world.layer_bits[slot] != 0) & (friends != slot)]
    offset = world.pos[friends] - world.order_point[slot]
    inside = offset[:, 0] ** 2 + offset[:, 1] ** 2 < distance**2
    area = float((world.separation[friends[inside]] ** 2).sum())
    return area >= MECHANICS.crowd_share * distance**2


def _next(world: World, slot: int) -> None:
    """Begin the next order of a unit; a patrol turns round, targets that are gone are skipped."""
    waiting = world.queue[slot]
    if world.order_kind[slot] == OrderKind.PATROL and not waiting:
        world.order_point[slot], world.order_origin[slot] = (
            world.order_origin[slot].copy(),
            world.order_point[slot].copy(),
        )
        world.nav_loop[slot] = world.blocked[slot] = 0
        return
    order: Order | None = None
    while waiting and order is None:
        order = waiting.pop(0)
        if order.target != NO_TAG and world.slot_of(order.target) == NOBODY:
            order = None
    commands.begin(world, slot, order)
