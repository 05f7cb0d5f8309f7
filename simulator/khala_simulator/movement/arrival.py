"""Crowds: when a walker whose way is blocked by others is near enough to its goal.

The game's own rule is not known; this one is an estimate. Used by ``systems.orders``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from khala_simulator.world.columns import Bools, Ints
    from khala_simulator.world.world import World

BLOCKED_LOOPS = 2


def packed(world: World, slots: Ints) -> Bools:
    """Return (k,) whether each walker has come as near to its goal as the crowd allows.

    That is when it stands before others close to the goal, when friends fill the ground between it and the goal, or
    when it is within the area that all of them would fill and has come no nearer for long.
    """
    offset = world.nav_goal.take(slots, 0) - world.pos.take(slots, 0)
    squared = offset[:, 0] ** 2 + offset[:, 1] ** 2
    blocked = world.blocked.take(slots)
    near = world.separation.take(slots) + MECHANICS.crowd_near
    arrived: Bools = (blocked >= MECHANICS.crowd_patience) & (squared < near**2)
    bodies = world.live
    area = world.separation.take(bodies) ** 2
    could = ~arrived & (squared * MECHANICS.crowd_share <= area.sum())  # no walker is packed farther out than this
    known = world.nav_loop.take(slots) > 0  # the way has been checked since the order
    arrived |= could & known & (world.loop - world.nav_best_loop.take(slots) > MECHANICS.crowd_stall)
    worth = np.flatnonzero(could & ~arrived & (blocked >= BLOCKED_LOOPS))
    if worth.size:
        one, squared = slots.take(worth), squared.take(worth)
        offset = world.pos.take(bodies, 0) - world.nav_goal.take(one, 0)[:, None, :]
        inside = offset[..., 0] ** 2 + offset[..., 1] ** 2 < squared[:, None]
        inside &= world.owner.take(bodies) == world.owner.take(one)[:, None]
        inside &= (world.layer_bits.take(bodies) & world.layer_bits.take(one)[:, None]) != 0
        inside &= bodies != one[:, None]
        arrived[worth] = np.where(inside, area, 0.0).sum(axis=1) >= MECHANICS.crowd_share * squared
    return arrived
