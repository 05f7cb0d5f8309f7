"""Pathfinding: free cells, connected parts and shortest ways over a terrain with its structures.

A ``Surface`` is one grid of free cells that never changes, so it remembers the ways it has found, across games too.
``surface`` finds the one that holds now on a game's ``Ground``, whose structures come and go. Positions are world
units, cells are flat indices ``y * width + x``; a unit is a point here; ``systems.collision`` has its body.
"""

from __future__ import annotations

import heapq
import math
from array import array
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import which
from khala_simulator.tables.layers import Layer

if TYPE_CHECKING:
    from khala_simulator.maps.game_map import Grid, Terrain
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.ground import Ground

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

PLACES_KEPT: Final = 2048
FIELDS_MB: Final = 32
"""Memory that the ways of one surface may take; more goals than that are forgotten, and searched again."""
FIELD_BYTES: Final = 17  # a cell of a field: its distance, the next cell, and whether it is settled
SIDE_CLEARANCE: Final = 0.3
SAMPLE_STEP: Final = 0.35
NEAR_SIDE: Final = 0.2
EDGE: Final = 1e-9
LOOK_AHEAD: Final = (1, 2, 3, 5, 8, 12, 18, 26)
NEIGHBOURS: Final = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1))


class Surface:
    """Free cells of one layer, with shortest ways to any cell.

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
        self._fields: dict[int, _Field] = {}
        self.fields_kept = max((FIELDS_MB << 20) // (FIELD_BYTES * self.flat.size), 1)
        self._places: dict[tuple[float, ...], tuple[Ints, Floats]] = {}
        # (cells,) bit i says that a step to the i-th neighbour is free; diagonals need both sides free
        self.steps: list[int] = self._free_steps(blocked).tolist()
        self._edges = _edges(self.width)
        self.native: object | None = None  # its cells as compiled code sees them

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

    def nearest(self, point: Floats, part: int, starts: Floats) -> Ints:
        """Return (k,) the cells of a connected part nearest to a point; the side of each start decides near ties."""
        cells, distance = self.around(point, part)
        sides = geometry.length(self.centre(cells) - starts[:, None])
        nearest: Ints = cells.take(np.argmin(distance + NEAR_SIDE * sides, axis=1))
        return nearest

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

    # lines --------------------------------------------------------------------------------------------------------

    def clear(self, start: Floats, end: Floats) -> Bools:
        """Return (k,) whether a body of ordinary width gets straight from ``start`` (k, 2) to ``end`` (k, 2)."""
        result = self._box_is_free(start, end)
        if np.count_nonzero(result) < len(result):
            unsure = which(~result)
            result[unsure] = self._sampled(start.take(unsure, 0), end.take(unsure, 0))
        return result

    def _box_is_free(self, start: Floats, end: Floats) -> Bools:
        low = np.floor(np.minimum(start, end) + (self.shift - SIDE_CLEARANCE)).astype(np.int64)
        high = np.floor(np.maximum(start, end) + (self.shift + SIDE_CLEARANCE)).astype(np.int64) + 1
        np.maximum(low, 0, out=low)
        np.minimum(high, self._last + 1, out=high)
        left, right = low[:, 0], high[:, 0]
        below, above = low[:, 1] * (self.width + 1), high[:, 1] * (self.width + 1)
        s = self.sums
        free = s.take(above + right) - s.take(below + right) - s.take(above + left) + s.take(below + left)
        size = high - low
        result: Bools = np.equal(free, size[:, 0] * size[:, 1])
        return result

    def _sampled(self, start: Floats, end: Floats) -> Bools:
        offset = end - start
        distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
        count = int(float(distance.max()) / SAMPLE_STEP) + 2
        share = np.linspace(0.0, 1.0, count)
        scale = SIDE_CLEARANCE / np.maximum(distance, SIDE_CLEARANCE)
        side = np.stack([-offset[:, 1] * scale, offset[:, 0] * scale], axis=1)
        line = start[:, None, :] + offset[:, None, :] * share[None, :, None]
        edges = np.empty((2, *line.shape))
        np.add(line, side[:, None, :], out=edges[0])
        np.subtract(line, side[:, None, :], out=edges[1])
        result: Bools = np.logical_and.reduce(self.flat.take(self.cell(edges)), axis=(0, 2))
        return result

    # ways ---------------------------------------------------------------------------------------------------------

    def corners(self, start: Floats, goal_cell: Ints) -> Floats:
        """Return (k, 2) the farthest cell centre on the way to each goal cell that can be walked to straight.

        Each start must lie in the connected part of its goal.
        """
        here = self.cell(start)
        steps = np.empty((len(here), len(LOOK_AHEAD)), dtype=np.int64)
        for goal in dict.fromkeys(goal_cell.tolist()):
            mine = goal_cell == goal
            steps[mine] = self._follow(here[mine], goal)
        ahead = self.centre(steps)  # (k, len(LOOK_AHEAD), 2)
        result: Floats = ahead[np.arange(len(steps)), self._farthest(start, ahead)]
        return result

    def _farthest(self, start: Floats, ahead: Floats) -> Ints:
        """Return (k,) the last of the places ``ahead`` (k, m, 2) that each can walk to straight, at least the first.

        Found by halving: a walker that can't reach one place straight is assumed not to reach a later one.
        """
        k, m = ahead.shape[:2]
        near = np.zeros(k, dtype=np.int64)
        far = np.full(k, m - 1)
        at = far.copy()
        unsure = np.arange(k)
        while unsure.size:
            seen = self.clear(start.take(unsure, 0), ahead[unsure, at.take(unsure)])
            near[unsure[seen]] = at[unsure[seen]]
            far[unsure[~seen]] = at[unsure[~seen]] - 1
            at = (near + far + 1) // 2
            unsure = which(near < far)
        return near

    def distance(self, start: Floats, goal: Floats) -> float:
        """Return the length of the way between two points, 0 when there is none (the API's convention)."""
        a, b = int(self.cell(start)), int(self.cell(goal))
        if not (self.flat[a] and self.flat[b]) or self.part[a] != self.part[b]:
            return 0.0
        if self.clear(start[None], goal[None])[0]:
            return math.dist(start, goal)
        return self._field(b, [a]).distance[a]

    def next_cells(self, cells: Ints, goal: int) -> Ints:
        """Return (k,) the next cell on the way from each of ``cells`` to a goal cell of the same connected part."""
        result: Ints = self._field(goal, cells.tolist()).towards_array().take(cells)
        return result

    def _follow(self, cells: Ints, goal: int) -> Ints:
        """Return (k, len(LOOK_AHEAD)) the cells so many steps along the way from each of ``cells``."""
        towards = self._field(goal, cells.tolist()).towards_array()
        steps, at = [], 0
        for wanted in LOOK_AHEAD:
            while at < wanted:
                cells = towards.take(cells)
                at += 1
            steps.append(cells)
        return np.stack(steps, axis=1)

    def _field(self, goal: int, cells: list[int]) -> _Field:
        """Return the ways to ``goal``, as far as they are needed from ``cells``."""
        found = self._fields.get(goal)
        if found is None:
            if len(self._fields) >= self.fields_kept:
                self._fields.clear()
            found = self._fields[goal] = _Field(goal, self.flat.size)
        found.reach(cells, self.steps, self._edges)
        return found

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
            one, other = sorted((find(run), find(touching)))
            root[other] = one
            touching += 1
    numbers = {first: number for number, first in enumerate(sorted({find(run) for run in range(len(runs))}))}
    parts = np.full((height, width), -1, dtype=np.int64)
    for run, (row, begin, end) in enumerate(runs):
        parts[row, begin:end] = numbers[find(run)]
    return parts


class _Field:
    """The shortest ways to one goal, searched outwards only as far as requested (Dijkstra).

    For every settled cell, ``towards`` holds the next one on its way and ``distance`` its distance; a cell that is not
    settled yet, or has no way, leads to itself.
    """

    def __init__(self, goal: int, cells: int) -> None:
        self.distance = [math.inf] * cells
        self.distance[goal] = 0.0
        self.towards = array("q", np.arange(cells).tobytes())
        self._settled = bytearray(cells)
        self._heap = [(0.0, goal)]

    def towards_array(self) -> Ints:
        """Return (cells,) ``towards`` as an array that shares its memory; cells not settled have no meaning in it."""
        return np.frombuffer(self.towards, dtype=np.int64)

    def reach(self, cells: list[int], steps: list[int], edges: list[list[tuple[int, float]]]) -> None:
        """Go on until all of ``cells`` are settled or nothing is left to settle."""
        settled, heap = self._settled, self._heap
        wanted = {cell for cell in cells if not settled[cell]}
        if not wanted or not heap:
            return
        distance, towards = self.distance, self.towards
        while heap and wanted:
            reached, cell = heapq.heappop(heap)
            if settled[cell]:
                continue
            settled[cell] = 1
            wanted.discard(cell)
            for offset, cost in edges[steps[cell]]:
                neighbour, further = cell + offset, reached + cost
                if further < distance[neighbour]:
                    distance[neighbour] = further
                    towards[neighbour] = cell
                    heapq.heappush(heap, (further, neighbour))


@lru_cache(maxsize=64)
def _edges(width: int) -> list[list[tuple[int, float]]]:
    """Return for every set of free steps (8 bits) the offset of each in a flat grid of that width, and its length."""
    moves = [(dy * width + dx, math.sqrt(dx * dx + dy * dy)) for dx, dy in NEIGHBOURS]
    return [[move for bit, move in enumerate(moves) if mask >> bit & 1] for mask in range(256)]


@lru_cache(maxsize=64)
def _bare_surface(terrain: Terrain, layer: Layer) -> Surface:
    """Return the surface of a terrain without structures, shared by all games on it."""
    return _surface(_layer_grid(terrain, layer), layer)


def _layer_grid(terrain: Terrain, layer: Layer) -> Grid:
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


def surface(ground: Ground, layer: Layer, without: tuple[int, ...] = ()) -> Surface:
    """Return the surface that units of a layer move on now, as if some structures (slots) were not there."""
    found = ground.surfaces.get((layer, without))
    if not isinstance(found, Surface):
        bare = layer is Layer.AIR or len(ground.blocked) == len(without)
        found = _bare_surface(ground.terrain, layer) if bare else _surface(_free_now(ground, layer, without), layer)
        ground.surfaces[layer, without] = found
    return found


def _free_now(ground: Ground, layer: Layer, without: tuple[int, ...]) -> Grid:
    return ground.with_structures(_layer_grid(ground.terrain, layer), without)
