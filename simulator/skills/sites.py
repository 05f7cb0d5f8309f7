"""Sites: whether a structure that comes down somewhere has room there.

For what lands or is dropped; building sites, with power, creep and resources, are construction's matter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator.columns import NOBODY
from simulator.stats import GROUND_PLANE
from simulator.systems.placement import snapped

if TYPE_CHECKING:
    from simulator.casts import Point
    from simulator.columns import Ints
    from simulator.records import UnitType
    from simulator.world import World


def cells_of(world: World, unit: UnitType, point: Point) -> Ints:
    """(k, 2) cells that a structure would block with its centre at ``point``."""
    footprint = world.catalog.footprints.get(unit.footprint)
    corner = np.floor(np.array(point) + 1e-9).astype(np.int64)
    if footprint is None or not footprint.cells:
        return corner[None]
    cells: Ints = corner + np.array(footprint.cells, dtype=np.int64)
    return cells


def centre(world: World, unit: UnitType, point: Point) -> Point:
    """The point nearest to ``point`` at which the structure lies on the grid of cells."""
    footprint = world.catalog.footprints.get(unit.footprint)
    return snapped(point, footprint.size) if footprint is not None and footprint.cells else point


def is_free(world: World, unit: UnitType, point: Point, *, ignoring: int = NOBODY) -> bool:
    """Whether the ground under a structure bears it, and nothing else stands there: no structure and no unit."""
    cells = cells_of(world, unit, point)
    width, height = world.map.terrain.size
    if not ((cells >= 0) & (cells < (width, height))).all():
        return False
    x, y = cells[:, 0], cells[:, 1]
    if not (world.map.terrain.build[y, x] & (world.ground.walk[y, x] | ~world.map.terrain.walk[y, x])).all():
        return False
    return not _stands_in(world, cells, ignoring).size


def _stands_in(world: World, cells: Ints, ignoring: int) -> Ints:
    """Slots of the bodies on the ground whose edge is inside the box around the cells."""
    slots = world.live
    solid = (world.plane_bits[slots] & GROUND_PLANE != 0) & (world.layer_bits[slots] != 0) & (slots != ignoring)
    slots = slots[solid & ~world.walled[slots]]
    low, high = cells.min(axis=0), cells.max(axis=0) + 1
    nearest = np.clip(world.pos[slots], low, high)
    offset = world.pos[slots] - nearest
    touching = offset[:, 0] ** 2 + offset[:, 1] ** 2 < world.separation[slots] ** 2 - 1e-6
    found: Ints = slots[touching]
    return found
