"""Pathfinding: free cells and connected parts of a terrain with its structures.

A ``Surface`` is one grid of free cells that never changes, so what was found on it is remembered, across games too.
``surface`` finds the one that holds now on a game's ``BuiltGround``, whose structures come and go; ``grids`` has its
cells for the rules, ``ways`` the shortest ways over them. Positions are world units, cells are flat indices
``y * width + x``; a unit is a point here; ``systems.collision`` has its body.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import which
from khala_simulator.tables.layers import Layer

if TYPE_CHECKING:
    from khala_simulator.maps.game_map import Grid, MapTerrain
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.ground import BuiltGround

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

PLACES_KEPT: Final = 2048
FIELDS_MB: Final = 32
"""Memory that the ways of one surface may take; more goals than that are forgotten, and searched again."""
FIELD_BYTES: Final = 17  # a cell of a field: its distance, the next cell, and whether it is settled
NEAR_SIDE: Final = 0.2
EDGE: Final = 1e-9
NEIGHBOURS: Final = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1))


class Surface:
    """Free cells of one layer, and which of them are connected.

    The cells of a surface with a ``shift`` lie so much lower on both axes than those of the terrain.
    """

    def __init__(self, free: Grid, shift: float = 0.0) -> None:
        self.free = free
        self.shift = shift
        self.height, self.width = free.shape
        self._last = np.array([self.width - 1, self.height - 1])
        self.flat: Bools = free.ravel()
        blocked = {(dx, dy): self._neighbour_blocked(dx, dy) for dx, dy in NEIGHBOURS}
        # free with all eight neighbours free: a body of at most one cell touches no wall from here
        self.open: Bools = self.flat & ~np.logical_or.reduce(list(blocked.values()))
        # (cells, 2) whether the neighbour towards lower and towards higher x and y is blocked, as 0 and 1
        self.walls_low: Floats = np.stack([blocked[-1, 0], blocked[0, -1]], axis=1).astype(np.float64)
        self.walls_high: Floats = np.stack([blocked[1, 0], blocked[0, 1]], axis=1).astype(np.float64)
        # corners of a cell (as offsets) at which only the diagonal neighbour is blocked, and of which cells
        self.spikes: list[tuple[Floats, Bools]] = [
            (np.array([max(dx, 0), max(dy, 0)], dtype=np.float64), blocked[dx, dy] & ~blocked[dx, 0] & ~blocked[0, dy])
            for dx, dy in NEIGHBOURS
            if dx and dy
        ]
        self.spiked: Bools = np.logical_or.reduce([cells for _, cells in self.spikes])
        # (height + 1, width + 1) how many cells are free below and to the left
        self.sums: Ints = np.pad(np.cumsum(np.cumsum(free, axis=0, dtype=np.int64), axis=1), ((1, 0), (1, 0)))
        self.fields_kept = max((FIELDS_MB << 20) // (FIELD_BYTES * self.flat.size), 1)
        self._places: dict[tuple[float, ...], tuple[Ints, Floats]] = {}
        # (cells,) bit i says that a step to the i-th neighbour is free; diagonals need both sides free
        self.steps: NDArray[np.uint8] = self._free_steps(blocked)
        self.grid: object | None = None  # its cells as the rules read them, made when they need them

    def _neighbour_blocked(self, dx: int, dy: int) -> Bools:
        """Return (cells,) whether the neighbour at an offset is blocked; beyond the grid everything is."""
        padded = np.pad(self.free, 1)
        shifted = padded[1 + dy : 1 + dy + self.height, 1 + dx : 1 + dx + self.width]
        return ~shifted.ravel()

    def _free_steps(self, blocked: dict[tuple[int, int], Bools]) -> NDArray[np.uint8]:
        """Return (cells,) the bits of ``steps``."""
        steps = np.zeros(self.flat.size, dtype=np.uint8)
        for bit, (dx, dy) in enumerate(NEIGHBOURS):
            free = self.flat & ~blocked[dx, dy]
            if dx and dy:
                free &= ~blocked[dx, 0] & ~blocked[0, dy]
            steps |= free.astype(np.uint8) << bit
        return steps

    # cells --------------------------------------------------------------------------------------------------------

    def cell(self, points: Floats) -> Ints:
        """Return the cells under points (..., 2); points outside count as the nearest cell inside."""
        at = (points + self.shift if self.shift else points).astype(np.int64)
        np.maximum(at, 0, out=at)
        np.minimum(at, self._last, out=at)
        result: Ints = at[..., 1] * self.width + at[..., 0]
        return result

    def centre(self, cells: Ints) -> Floats:
        """Return the centres (..., 2) of cells."""
        centre = np.empty((*cells.shape, 2))
        rows = cells // self.width
        centre[..., 0] = cells - rows * self.width
        centre[..., 1] = rows
        centre += 0.5 - self.shift
        return centre

    def around(self, point: Floats, part: int) -> tuple[Ints, Floats]:
        """Return the cells of a connected part among which a start may choose, and how far from the point they are.

        A start that prefers a cell to the nearest one, d away, is at most their distance nearer to it, so the cell is
        at most d (1 + NEAR_SIDE) / (1 - NEAR_SIDE) away. A whole army asks for the same goal again and again.
        """
        key = (*point.tolist(), part)
        found = self._places.get(key)
        if found is None:
            if len(self._places) >= PLACES_KEPT:
                self._places.clear()
            distance = geometry.length(self._centres[part] - point)
            near = which(distance <= distance.min() * (1.0 + NEAR_SIDE) / (1.0 - NEAR_SIDE) + EDGE)
            found = self._places[key] = self._members[part].take(near), distance.take(near)
        return found

    def nearest_free(self, point: Floats) -> int | None:
        """Return the free cell nearest to ``point`` over all parts, or None when nothing is free."""
        candidates = [cells[np.argmin(d)] for cells, d in (self.around(point, i) for i in range(len(self._members)))]
        if not candidates:
            return None
        return int(candidates[int(np.argmin(geometry.length(self.centre(np.array(candidates)) - point)))])

    @cached_property
    def part(self) -> Ints:
        """(cells,) number of the connected part each cell belongs to, -1 where it is blocked.

        A diagonal step needs both sides free, so that what is connected is connected by the four straight ones.
        """
        part: Ints = connected_parts(self.free).ravel()
        return part

    @cached_property
    def _members(self) -> list[Ints]:
        """The cells of each connected part, ascending."""
        return [np.flatnonzero(self.part == number) for number in range(int(self.part.max()) + 1)]

    @cached_property
    def _centres(self) -> list[Floats]:
        """The centres of these cells."""
        return [self.centre(members) for members in self._members]


def connected_parts(free: Grid) -> Ints:
    """Return (h, w) number of the part that each free cell belongs to by straight steps, -1 where it is not free.

    Runs of free cells in each row are joined to those they touch in the row above; parts are numbered in the order of
    their first cell. A map has a few hundred runs, but thousands of cells.
    """
    height, width = free.shape
    padded = np.zeros((height, width + 2), dtype=np.int8)
    padded[:, 1:-1] = free
    change = np.diff(padded, axis=1)
    rows, begins = np.nonzero(change == 1)
    _, ends = np.nonzero(change == -1)
    runs = list(zip(rows.tolist(), begins.tolist(), ends.tolist(), strict=True))
    root = list(range(len(runs)))

    def find(run: int) -> int:
        while root[run] != run:
            root[run] = root[root[run]]
            run = root[run]
        return run

    above = 0
    for run, (row, begin, end) in enumerate(runs):
        while runs[above][0] < row - 1 or (runs[above][0] == row - 1 and runs[above][2] <= begin):
            above += 1
        touching = above
        while runs[touching][0] == row - 1 and runs[touching][1] < end:
            first, later = sorted((find(run), find(touching)))
            root[later] = first
            touching += 1
    numbers = {first: number for number, first in enumerate(sorted({find(run) for run in range(len(runs))}))}
    parts = np.full((height, width), -1, dtype=np.int64)
    for run, (row, begin, end) in enumerate(runs):
        parts[row, begin:end] = numbers[find(run)]
    return parts


@lru_cache(maxsize=64)
def _bare_surface(terrain: MapTerrain, layer: Layer) -> Surface:
    """Return the surface of a terrain without structures, shared by all games on it."""
    return _surface(_layer_grid(terrain, layer), layer)


def _layer_grid(terrain: MapTerrain, layer: Layer) -> Grid:
    if layer is Layer.AIR:
        grid = np.zeros_like(terrain.walk)
        x0, y0, x1, y1 = terrain.playable
        grid[y0:y1, x0:x1] = True
        return grid
    return terrain.glide if layer is Layer.GLIDE else terrain.walk


def _surface(free: Grid, layer: Layer) -> Surface:
    """Return the surface of free cells; wide bodies stand on corners at which four free cells meet."""
    if layer is not Layer.WIDE:
        return Surface(free)
    corners = np.zeros_like(free)
    corners[1:, 1:] = free[1:, 1:] & free[:-1, 1:] & free[1:, :-1] & free[:-1, :-1]
    return Surface(corners, shift=0.5)


def surface(ground: BuiltGround, layer: Layer, without: tuple[int, ...] = ()) -> Surface:
    """Return the surface that units of a layer move on now, as if some structures (slots) were not there."""
    found = ground.surfaces.get((layer, without))
    if not isinstance(found, Surface):
        bare = layer is Layer.AIR or len(ground.blocked) == len(without)
        found = _bare_surface(ground.terrain, layer) if bare else _surface(_free_now(ground, layer, without), layer)
        ground.surfaces[layer, without] = found
    return found


def _free_now(ground: BuiltGround, layer: Layer, without: tuple[int, ...]) -> Grid:
    return ground.with_structures(_layer_grid(ground.terrain, layer), without)
