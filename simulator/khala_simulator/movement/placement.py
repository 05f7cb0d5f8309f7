"""Placement: where a new unit fits, as near as possible to the wanted point.

Units made at one point take the nearest free places of a fine grid, ring by ring, each ring from the south
counter-clockwise; bodies keep their radii apart. Inferred from where units of recorded games were born.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.movement import grids
from khala_simulator.native import columns, memory
from khala_simulator.tables.layers import layer_of
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells, Points
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.world import World

CANDIDATE_STEP = 0.25
SEARCH_RADII = (3.0, 6.0, 12.0)
ROUNDING = 1e-6


def free_places(world: World, unit: UnitType, point: tuple[float, float], count: int) -> list[tuple[float, float]]:
    """Return the places nearest to ``point`` where ``count`` new units touch no body, no wall and not each other.

    Units that find no place within the search radius stand on ``point``. Structures go on the cell grid, where their
    footprint fits it, all at the same place.
    """
    footprint = world.catalog.footprints.get(unit.footprint)
    if footprint is not None and footprint.cells:
        return [snap(point, footprint.size)] * count
    places: list[tuple[float, float]] = []
    for radius in SEARCH_RADII:
        places = _places_within(world, unit, point, count, radius)
        if len(places) == count:
            return places
    return places + [point] * (count - len(places))


def _places_within(
    world: World, unit: UnitType, point: tuple[float, float], count: int, radius: float
) -> list[tuple[float, float]]:
    bodiless = memory.ints(world.stats.layer_bits)[unit.row] == 0
    apart = 0.0 if bodiless else 2.0 * unit.radius - ROUNDING
    return [(x, y) for x, y in _search(world, unit, point, radius, NOBODY, count, apart).tolist()]


def candidates(
    world: World, unit: UnitType, point: tuple[float, float], radius: float, *, ignoring: int = NOBODY
) -> Floats:
    """Return (k, 2) places within ``radius`` of a point where one more unit touches no body and no wall, nearest first.

    The body of the unit in the slot ``ignoring`` does not count.
    """
    return _search(world, unit, point, radius, ignoring, -1, 0.0)


def _search(
    world: World, unit: UnitType, point: tuple[float, float], radius: float, ignoring: int, most: int, apart: float
) -> Floats:
    """Return (k, 2) places around a point, nearest first, that are free for one more unit.

    Args:
        world: The world.
        unit: Its type.
        point: The point.
        radius: How far from the point.
        ignoring: Slot of a unit whose body does not count, or ``NOBODY``.
        most: How many to find, -1 for all.
        apart: How far from each other they have to be.
    """
    x0, y0, x1, y1 = world.map.terrain.playable
    grid = grids.grid_of(world.ground, layer_of(unit))
    bits = memory.ints(world.stats.layer_bits)[unit.row]
    bodies = world.live[(world.layer_bits[world.live] & bits) != 0]
    bodies = bodies[bodies != ignoring]
    slots = memory.ints(bodies)
    c = columns.columns_of(world)
    reach = unit.radius - ROUNDING
    n = len(bodies)
    offsets = _offsets(radius)
    offset = memory.points(offsets)
    places: Floats = np.empty((len(offsets) if most < 0 else most, 2))
    found = memory.points(places)
    px, py = point
    count = 0
    for i in range(len(offsets)):
        if count == most:
            break
        at = memory.point(px + offset[i].x, py + offset[i].y)
        if (
            x0 <= at.x < x1
            and y0 <= at.y < y1
            and grid.flat[grids.cell_at(grid, at.x, at.y)]
            and _is_clear(c, slots, n, at, reach)
            and _is_apart(found, count, at, apart)
        ):
            found[count] = at
            count += 1
    return places[:count]


def _is_clear(c: Columns, slots: Cells, n: int, at: memory.Point, reach: float) -> bool:
    """Return whether a body of some size touches none of n others at a point."""
    for i in range(n):
        slot = slots[i]
        x = at.x - c.pos[slot].x
        y = at.y - c.pos[slot].y
        apart = c.radius[slot] + reach
        if x * x + y * y < apart * apart:
            return False
    return True


def _is_apart(places: Points, count: int, at: memory.Point, apart: float) -> bool:
    """Return whether a point is far enough from the first places."""
    if apart <= 0.0:
        return True
    for i in range(count):
        x = at.x - places[i].x
        y = at.y - places[i].y
        if x * x + y * y < apart * apart:
            return False
    return True


def snap(point: tuple[float, float], size: tuple[int, int]) -> tuple[float, float]:
    """Return the centre nearest to ``point`` at which a footprint of ``size`` cells lies on the grid."""
    x, y = (round(v - s / 2.0) + s / 2.0 for v, s in zip(point, size, strict=True))
    return x, y


@lru_cache(maxsize=16)
def _offsets(radius: float) -> Floats:
    """Return candidate offsets (k, 2), nearest first; equally near ones from the south counter-clockwise."""
    steps = round(radius / CANDIDATE_STEP)
    rings = sorted((a * a + b * b, a, b) for b in range(steps + 1) for a in range(b + 1))
    places: dict[tuple[int, int], None] = {}
    for squared, a, b in rings:
        if squared > steps * steps:
            break
        for x, y in ((a, -b), (-a, -b)):
            for _ in range(4):
                places[x, y] = None
                x, y = -y, x  # noqa: PLW2901
    return np.array(list(places)) * CANDIDATE_STEP
