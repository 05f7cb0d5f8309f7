"""Crowds: when a walker that others keep from its goal has come near enough.

The game's own rule is not known; this one is an estimate. Used by ``systems.orders``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator.mechanics import MECHANICS

if TYPE_CHECKING:
    from simulator.columns import Bools, Floats, Ints
    from simulator.world import World


def packed(world: World, slots: Ints, squared: Floats) -> Bools:
    """(k,) whether friends fill the ground between each blocked unit and its goal, or keep it out for long nearby.

    Args:
        world: The game.
        slots: (k,) units whose way is blocked.
        squared: (k,) their distances from their order's points, squared.
    """
    near = world.separation.take(slots) + MECHANICS.crowd_near
    near_enough: Bools = (world.blocked.take(slots) >= MECHANICS.crowd_patience) & (squared < near**2)
    bodies = world.live
    area = world.separation.take(bodies) ** 2
    # nobody is packed farther out than all bodies together could reach
    worth = np.flatnonzero(~near_enough & (squared * MECHANICS.crowd_share <= area.sum()))
    if worth.size:
        one = slots.take(worth)
        offset = world.pos.take(bodies, 0) - world.order_point.take(one, 0)[:, None, :]
        inside = offset[..., 0] ** 2 + offset[..., 1] ** 2 < squared.take(worth)[:, None]
        inside &= world.owner.take(bodies) == world.owner.take(one)[:, None]
        inside &= (world.layer_bits.take(bodies) & world.layer_bits.take(one)[:, None]) != 0
        inside &= bodies != one[:, None]
        near_enough[worth] = np.where(inside, area, 0.0).sum(axis=1) >= MECHANICS.crowd_share * squared.take(worth)
    return near_enough
