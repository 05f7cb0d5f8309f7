"""Teleports: put units elsewhere at once, where they fit, or new units beside their maker.

Used by blinks, recalls, phase shifts, transports and summons. The skills decide what a teleport costs and who may use
it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.combat import lifecycle
from khala_simulator.movement import placement
from khala_simulator.numeric import geometry

if TYPE_CHECKING:
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

SEARCH_RADII = (1.5, 4.0, 8.0)
EDGE = 1e-6


def to(world: World, slot: int, point: Point) -> None:
    """Put a unit elsewhere at once; its way is searched again from there."""
    world.pos[slot] = world.nav_point[slot] = world.guard[slot] = point
    world.speed[slot] = 0.0
    world.aside[slot] = 0.0
    world.nav_end[slot] = world.returning[slot] = False
    world.nav_loop[slot] = world.blocked[slot] = world.detour[slot] = world.scan_loop[slot] = 0
    world.resting_version = world.looked_at = -1
    world.scan_now = True


def turn(world: World, slot: int, point: Point) -> None:
    """Turn a unit to face a point at once, unless it stands on it."""
    offset = np.array(point) - world.pos[slot]
    length = float(geometry.length(offset[None])[0])
    if length > EDGE and not world.unit_type(slot).unturnable:
        world.heading[slot] = offset / length


def spot_near(
    world: World, slot: int, point: Point, *, reach: float = math.inf, seen_by: int | None = None
) -> Point | None:
    """Return the place nearest to ``point`` where a unit fits, or None when there is none.

    Args:
        world: The game.
        slot: The unit; its own body is ignored.
        point: Where it is wanted.
        reach: How far from where it is now the place may be, centre to centre.
        seen_by: The place must be in this player's sight.
    """
    unit = world.unit_type(slot)
    here = world.pos[slot]
    for radius in SEARCH_RADII:
        at = placement.candidates(world, unit, point, radius, ignoring=slot)
        if math.isfinite(reach):
            at = at[geometry.length(at - here) <= reach + EDGE]
        if seen_by is not None and world.fog:
            x, y = at[:, 0].astype(np.int64), at[:, 1].astype(np.int64)
            at = at[world.visibility[seen_by][y, x] == SEEN]
        if len(at):
            x0, y0 = at[0].tolist()
            return x0, y0
    return None


SEEN = 2


def within(world: World, slot: int, point: Point, reach: float) -> Point:
    """Return ``point``, or where the straight way to it is ``reach`` long."""
    x, y = world.pos[slot].tolist()
    away = math.hypot(point[0] - x, point[1] - y)
    if away <= reach:
        return point
    return x + (point[0] - x) * reach / away, y + (point[1] - y) * reach / away


def beside(world: World, maker: int, unit: UnitType, count: int = 1) -> list[int]:
    """Put new units of the maker's owner where they fit around it, facing as it does; return their slots."""
    x, y = world.pos[maker].tolist()
    owner = int(world.owner[maker])
    made = [lifecycle.spawn(world, unit, owner, place) for place in placement.free_places(world, unit, (x, y), count)]
    world.heading[made] = world.turret[made] = world.heading[maker]
    return made


def live_until(world: World, slot: int, loop: float) -> None:
    """Make a unit's life end by itself at a loop."""
    world.expires[slot] = math.ceil(loop)
    world.mortal = True
