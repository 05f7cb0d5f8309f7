"""The ground of a map, as arrays: buildable and walkable cells, heights, and possible starts of players.

Grids are indexed `[x, y]` in cells of the world, y up, so that cell (x, y) is the square from x to x + 1. It knows no
unit; `khala_bridge.state.ground.land` has the things on the ground at a moment.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from khala_bridge.frames import WorldPoint
    from khala_bridge.state import EpisodeInfo, Grid

Bools: TypeAlias = NDArray[np.bool_]
Bytes: TypeAlias = NDArray[np.uint8]
Floats: TypeAlias = NDArray[np.float32]
HEIGHT_LOW = -16.0
HEIGHT_STEP = 32.0 / 255.0
"""World height of a byte of the terrain, z = -16 + 32 byte / 255, as the game's API has it."""
SEED_REACH = 4
"""Cells around a point from which ways begin: there may be a structure on the point itself."""


@dataclass(frozen=True, eq=False, slots=True)
class MapGround:
    """The ground of one map; one object for all snapshots of an episode."""

    buildable: Bools
    """(w, h): cells where the bare ground takes structures."""
    walkable: Bools
    """(w, h): cells where ground units can walk, if no structure or resource stands there."""
    height: Floats
    """(w, h): height of the lower left corner of each cell, in world units."""
    starts: tuple[WorldPoint, ...]
    """Possible starts of other players."""

    @classmethod
    def of(cls, info: EpisodeInfo) -> MapGround:
        """Return the ground of an episode's map; cached by the map's own grids."""
        return _ground(info.size, info.playable, info.placement, info.pathing, info.height, info.starts)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in cells."""
        return self.buildable.shape[0], self.buildable.shape[1]

    def holds(self, x: float, y: float) -> bool:
        """Return True if a point is on the grids."""
        width, height = self.size
        return 0 <= x < width and 0 <= y < height

    def level(self, x: float, y: float) -> float:
        """Return the height of the ground at a point, in world units; outside of the map, that of the nearest cell."""
        width, height = self.size
        return float(self.height[min(max(int(x), 0), width - 1), min(max(int(y), 0), height - 1)])

    def ways_from(self, point: WorldPoint) -> Floats:
        """Return the distances (w, h) that ground units walk from a point to each cell; infinite if there is no way.

        Ways go around cliffs but through structures. They alternate between grid steps with and without diagonals: up
        to a ninth shorter than the real way, and without the first `SEED_REACH` cells.
        """
        return _ways(self, (int(point.x), int(point.y)))


@functools.lru_cache(maxsize=8)
def _ground(
    size: tuple[int, int],
    playable: tuple[int, int, int, int],
    placement: Grid,
    pathing: Grid,
    height: Grid,
    starts: tuple[WorldPoint, ...],
) -> MapGround:
    empty = np.zeros(size, np.uint8)
    inside = np.zeros(size, np.bool_)
    x0, y0, x1, y1 = playable
    inside[x0:x1, y0:y1] = True
    built, walked, raised = (grid.cells() for grid in (placement, pathing, height))
    buildable = (empty if built is None else built).astype(np.bool_) & inside
    # the game's grid is not walkable under the structures of the start, but the ground there is
    walkable = ((empty if walked is None else walked).astype(np.bool_) & inside) | buildable
    levels = HEIGHT_LOW + HEIGHT_STEP * (empty if raised is None else raised).astype(np.float32)
    for array in (buildable, walkable, levels):
        array.setflags(write=False)
    return MapGround(buildable, walkable, levels.astype(np.float32), starts)


@functools.lru_cache(maxsize=64)
def _ways(ground: MapGround, cell: tuple[int, int]) -> Floats:
    width, height = ground.size
    far = np.full((width + 2, height + 2), np.inf, np.float32)
    open_ = np.pad(ground.walkable, 1)
    near = np.zeros_like(open_)
    x, y = (min(max(v, 0), limit - 1) + 1 for v, limit in zip(cell, ground.size, strict=True))
    near[max(x - SEED_REACH, 0) : x + SEED_REACH + 1, max(y - SEED_REACH, 0) : y + SEED_REACH + 1] = True
    front = near & open_
    far[front] = 0.0
    left = open_ & ~front
    for step in itertools.count(1):
        front = grown(front, diagonal=step % 2 == 0) & left
        if not front.any():
            break
        far[front] = step
        left &= ~front
    result: Floats = np.ascontiguousarray(far[1:-1, 1:-1])
    result.setflags(write=False)
    return result


def grown(front: Bools, *, diagonal: bool) -> Bools:
    """Return some cells with their neighbours: four of each, or eight."""
    grown = front.copy()
    grown[1:] |= front[:-1]
    grown[:-1] |= front[1:]
    rows = grown if diagonal else front
    result = grown.copy()
    result[:, 1:] |= rows[:, :-1]
    result[:, :-1] |= rows[:, 1:]
    return result
