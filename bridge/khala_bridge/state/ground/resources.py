"""Resources of the map, and the places where a town hall gathers them best.

A base place is the nearest place to its resources where the game allows a town hall: as far from each as the rings
of their footprints demand, with the least sum of distances. So it is found on every map, without a list of places.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground.footprints import footprints

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from khala_bridge.state.ground.footprints import Cells
    from khala_bridge.state.ground.terrain import Bools, Floats, MapGround

SPREAD = 8.5
"""Largest distance between neighbouring resources of one base; the usual figure of bots, an estimate."""
SAME_LEVEL = 1.25
"""Difference in height that resources of one base stay below, in world units; also an estimate."""
MIN_FIELDS = 3
"""A cluster with fewer mineral fields is an obstacle and no base."""
REACH = 10
"""World units around a cluster within which its town hall stands."""
KNOWN_START = 3.0
"""A start location within this distance of a computed place is the place."""


@dataclass(frozen=True, slots=True)
class Base:
    """A place for a town hall, and the resources around it."""

    place: WorldPoint
    fields: tuple[WorldPoint, ...]
    geysers: tuple[WorldPoint, ...]


Places = tuple[tuple[float, float], ...]


@functools.lru_cache(maxsize=32)
def base_places(ground: MapGround, fields: Places, geysers: Places, halls: Places = ()) -> tuple[Base, ...]:
    """Return every place for a town hall on a map, by ascending coordinates.

    Args:
        ground: of the map.
        fields: middles of the mineral fields.
        geysers: middles of the geysers.
        halls: where players begin; such a place is used unchanged.
    """
    everything = np.array([*fields, *geysers], float).reshape(-1, 2)
    free = _free_of(ground, fields, geysers)
    found = []
    for members in _clusters(ground, everything):
        of_fields = tuple(WorldPoint(*fields[i]) for i in members if i < len(fields))
        if len(of_fields) < MIN_FIELDS:
            continue
        place = _best_place(free, everything[members], halls)
        if place is not None:
            of_gas = tuple(WorldPoint(*geysers[i - len(fields)]) for i in members if i >= len(fields))
            found.append(Base(place, of_fields, of_gas))
    return tuple(sorted(found, key=lambda base: base.place))


def _clusters(ground: MapGround, places: NDArray[np.float64]) -> list[list[int]]:
    """Return the clusters of neighbouring places as indices, each in ascending order."""
    if not len(places):
        return []
    level = np.array([ground.level(x, y) for x, y in places.tolist()])
    apart = np.hypot(*(places[:, None, :] - places[None, :, :]).transpose(2, 0, 1))
    joined = (apart <= SPREAD) & (np.abs(level[:, None] - level[None, :]) < SAME_LEVEL)
    clusters = []
    left = set(range(len(places)))
    while left:
        members = set()
        border = {min(left)}
        while border:
            members |= border
            border = {int(i) for i in np.flatnonzero(joined[sorted(border)].any(axis=0))} - members
        left -= members
        clusters.append(sorted(members))
    return clusters


def _free_of(ground: MapGround, fields: Places, geysers: Places) -> Bools:
    """Return the cells (w, h) in which the middle of a town hall would be on free ground, clear of all resources."""
    clear = ground.buildable.copy()
    for name, places in (("mineral_field", fields), ("geyser", geysers)):
        footprint = footprints()[name]
        mark(clear, footprint.near, [footprint.cell(x, y) for x, y in places], value=False)
    return everywhere(clear, footprints()["town_hall"].cells)


def _best_place(free: Bools, resources: NDArray[np.float64], halls: Places) -> WorldPoint | None:
    low = np.maximum(resources.min(axis=0) - REACH, 0).astype(int)
    high = (resources.max(axis=0) + REACH).astype(int)
    cells = np.argwhere(free[low[0] : high[0], low[1] : high[1]]) + low
    if not len(cells):
        return None
    offset = (cells + 0.5)[:, None, :] - resources[None, :, :]
    total = np.round(np.hypot(offset[..., 0], offset[..., 1]).sum(axis=1), 6)
    x, y = (cells[int(np.argmin(total))] + 0.5).tolist()
    start = next((hall for hall in sorted(halls) if math.dist(hall, (x, y)) <= KNOWN_START), (x, y))
    return WorldPoint(*start)


# grids ----------------------------------------------------------------------------------------------------------------


def mark(grid: Bools, cells: Cells, at: Sequence[tuple[int, int]], *, value: bool) -> None:
    """Write a value into the cells (dx, dy) around each of some cells, as far as they are on the grid."""
    if not at:
        return
    where = (np.array(at)[:, None, :] + np.array(cells)).reshape(-1, 2)
    inside = ((where >= 0) & (where < grid.shape)).all(axis=1)
    grid[where[inside, 0], where[inside, 1]] = value


def coordinates(part: tuple[int, int], start: tuple[int, int] = (0, 0)) -> tuple[Floats, Floats]:
    """Return the lower left corners of the cells of a part of a grid: x as (w, 1) and y as (1, h)."""
    x = np.arange(start[0], start[0] + part[0], dtype=np.float32)
    y = np.arange(start[1], start[1] + part[1], dtype=np.float32)
    return x[:, None], y[None, :]


def everywhere(grid: Bools, cells: Cells) -> Bools:
    """Return the cells (w, h) around which all of the cells (dx, dy) are set; cells beyond the grid are not."""
    reach = max(max(abs(dx), abs(dy)) for dx, dy in cells)
    width, height = grid.shape
    padded = np.pad(grid, reach)
    result = np.ones_like(grid)
    for dx, dy in cells:
        result &= padded[reach + dx : reach + dx + width, reach + dy : reach + dy + height]
    return result
