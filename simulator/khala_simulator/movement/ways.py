"""Ways: the shortest ways round corners, over the cells of a grid.

``systems.navigation`` follows them; a unit is a point here, ``systems.collision`` has its body.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.movement import grids
from khala_simulator.movement.grids import Lines
from khala_simulator.movement.pathfinding import NEIGHBOURS
from khala_simulator.native import memory

if TYPE_CHECKING:
    from khala_simulator.movement.grids import SurfaceGrid
    from khala_simulator.movement.pathfinding import Surface
    from khala_simulator.numeric.geometry import Floats

LOOK_AHEAD: Final = (1, 2, 3, 5, 8, 12, 18, 26)
AHEAD: Final = len(LOOK_AHEAD)
STEP_X: Final = tuple(x for x, _ in NEIGHBOURS)
STEP_Y: Final = tuple(y for _, y in NEIGHBOURS)
COST: Final = tuple(math.sqrt(x * x + y * y) for x, y in NEIGHBOURS)


class Way:
    """A walker's way to a goal, and how far ahead on it the walker gets straight.

    Attributes:
        walker: The walker's slot.
        start: Where it is.
        goal: A cell in the connected part of the start.
        ahead: Cells on the way, so many steps on as ``LOOK_AHEAD`` says.
        near: The farthest of them that is known to be reached straight.
        far: The farthest that may be.
        tried: The one that is looked at.
    """

    walker: int
    start: memory.Point
    goal: int
    near: int
    far: int
    tried: int

    def __init__(self) -> None:
        self.ahead = [0, 0, 0, 0, 0, 0, 0, 0]


def way_from(walker: int, start: memory.Point, goal: int) -> Way:
    """Return a way that is not known yet."""
    way = Way()
    way.walker = walker
    way.start = start
    way.goal = goal
    return way


def find_corners(grid: SurfaceGrid, ways: list[Way]) -> None:
    """Find how far ahead on its way each walker gets straight, by halving.

    A walker that can't reach one place straight is assumed not to reach a later one.
    """
    field = None
    for way in ways:
        if field is None or field.goal != way.goal:
            field = _field_to(grid, way.goal)
        field.follow(grid, way)
        way.near = 0
        way.far = AHEAD - 1
        way.tried = AHEAD - 1
    lines = Lines(len(ways))
    unsure = ways
    while unsure:
        lines.count = 0
        for way in unsure:
            lines.add(way.start, grids.centre_of(grid, way.ahead[way.tried]))
        grids.clear(grid, lines)
        for i in range(lines.count):
            way = unsure[i]
            if lines.free[i]:
                way.near = way.tried
            else:
                way.far = way.tried - 1
            way.tried = (way.near + way.far + 1) // 2
        unsure = [way for way in unsure if way.near < way.far]


def corner_of(grid: SurfaceGrid, way: Way) -> memory.Point:
    """Return the farthest place on a way that its walker gets to straight, at least the next cell."""
    return grids.centre_of(grid, way.ahead[way.near])


def distance(surface: Surface, start: Floats, goal: Floats) -> float:
    """Return the length of the way between two points, 0 when there is none (the API's convention)."""
    grid = grids.read(surface)
    here = grids.cell_at(grid, start[0], start[1])
    there = grids.cell_at(grid, goal[0], goal[1])
    if not (grid.flat[here] and grid.flat[there]) or grid.part[here] != grid.part[there]:
        return 0.0
    line = Lines(1)
    line.add(memory.point(start[0], start[1]), memory.point(goal[0], goal[1]))
    grids.clear(grid, line)
    if line.free[0]:
        return math.dist(start, goal)
    field = _field_to(grid, there)
    field.reach(grid, here)
    return field.distance[here]


def _field_to(grid: SurfaceGrid, goal: int) -> Field:
    """Return the ways to a goal."""
    field = grid.fields.get(goal)
    if field is None:
        if len(grid.fields) >= grid.fields_kept:
            grid.fields.clear()
        field = Field(goal, grid.width * grid.height)
        grid.fields[goal] = field
    return field


class Field:
    """The shortest ways to one goal, searched outwards only as far as requested (Dijkstra).

    Attributes:
        goal: The cell to which they lead.
        distance: Of every settled cell from the goal.
        towards: The next cell on its way. One that is not settled yet, or has no way, leads to itself.
        settled: Whether the way from a cell is known.
    """

    def __init__(self, goal: int, cells: int) -> None:
        self.goal = goal
        self.arrays = (np.full(cells, np.inf), np.arange(cells, dtype=np.int64), memory.new_bools(cells))
        self.distance = memory.floats(self.arrays[0])
        self.towards = memory.ints(self.arrays[1])
        self.settled = memory.bools(self.arrays[2])
        self.heap = _Heap()
        self.distance[self.goal] = 0.0
        self.heap.push(0.0, self.goal)

    def follow(self, grid: SurfaceGrid, way: Way) -> None:
        """Write the cells that are ahead on a way."""
        cell = grids.cell_at(grid, way.start.x, way.start.y)
        if not self.settled[cell]:
            self.reach(grid, cell)
        at = 0
        for i in range(AHEAD):
            while at < LOOK_AHEAD[i]:
                cell = self.towards[cell]
                at += 1
            way.ahead[i] = cell

    def reach(self, grid: SurfaceGrid, wanted: int) -> None:
        """Go on until a cell is settled or nothing is left to settle."""
        heap = self.heap
        while heap.size and not self.settled[wanted]:
            cell = heap.pop()
            if self.settled[cell]:
                continue
            self.settled[cell] = True
            distance = self.distance[cell]
            steps = grid.steps[cell]
            for i in range(8):
                if steps >> i & 1:
                    neighbour = cell + STEP_Y[i] * grid.width + STEP_X[i]
                    further = distance + COST[i]
                    if further < self.distance[neighbour]:
                        self.distance[neighbour] = further
                        self.towards[neighbour] = cell
                        heap.push(further, neighbour)


class _Heap:
    """Cells and how far they may be, the nearest first, of equally near ones that with the lowest number."""

    def __init__(self) -> None:
        self.size = 0
        self.room = 0
        self.distance_array = memory.new_floats(0)
        self.cell_array = memory.new_ints(0)
        self.grow()

    def grow(self) -> None:
        """Make room for more."""
        self.room = 2 * self.room + 256
        self.distance_array = np.resize(self.distance_array, self.room)
        self.cell_array = np.resize(self.cell_array, self.room)
        self.distances = memory.floats(self.distance_array)
        self.cells = memory.ints(self.cell_array)

    def push(self, distance: float, cell: int) -> None:
        """Note that a cell may be so far away."""
        if self.size == self.room:
            self.grow()
        distances = self.distances
        cells = self.cells
        at = self.size
        self.size += 1
        while at > 0:
            above = (at - 1) // 2
            if not _comes_before(distance, cell, distances[above], cells[above]):
                break
            distances[at] = distances[above]
            cells[at] = cells[above]
            at = above
        distances[at] = distance
        cells[at] = cell

    def pop(self) -> int:
        """Take out the nearest cell."""
        distances = self.distances
        cells = self.cells
        nearest = cells[0]
        size = self.size - 1
        self.size = size
        distance = distances[size]
        cell = cells[size]
        at = 0
        below = 1
        while below < size:
            if below + 1 < size and _comes_before(
                distances[below + 1], cells[below + 1], distances[below], cells[below]
            ):
                below += 1
            if not _comes_before(distances[below], cells[below], distance, cell):
                break
            distances[at] = distances[below]
            cells[at] = cells[below]
            at = below
            below = 2 * at + 1
        distances[at] = distance
        cells[at] = cell
        return nearest


def _comes_before(distance: float, cell: int, other_distance: float, other_cell: int) -> bool:
    return distance < other_distance or (distance == other_distance and cell < other_cell)
