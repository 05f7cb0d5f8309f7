"""Flow: the ways of a crowd round the bodies that stand, to the free places from which it reaches its targets.

A ``Flow`` is a fine grid over a fight: where a body of one size has room, and how many steps it is from there to the
nearest place in reach of a target. The steps are counted outwards from those places, all cells of one step after those
of the step before, until every walker is reached. ``systems.flanking`` follows it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from khala_simulator.native import memory

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.movement.grids import SurfaceGrid

FINE: Final = 4  # cells of the grid in a cell of the ground, on each axis
MARGIN: Final = 4.0  # how far beyond the crowd its ways may lead; no hop leads out of the grid
NOWHERE: Final = 63  # more steps than are looked at
TAKEN: Final = NOWHERE + 1  # a cell that is not free
HOPS: Final = 2  # of up to two cells, from the nearest cell with a way to the point that a walker heads for
AROUND: Final = 2  # cells to each side in a hop
NEARER: Final = 1e-5  # what a square cell of distance to the goal weighs, where a step weighs 1


class Walker:
    """One of a crowd, and the way that is found for it.

    Attributes:
        slot: Its slot.
        at: Where it is.
        goal: Where it wants to go.
        ahead: The point that it heads for.
        left: How far that is.
        found: Whether there is a way.
        arrives: Whether the way ends there.
        settled: Whether others go round that place.
    """

    slot: int
    at: memory.Point
    goal: memory.Point
    ahead: memory.Point
    left: float
    found: bool
    arrives: bool
    settled: bool


def walker_of(slot: int, at: memory.Point, goal: memory.Point) -> Walker:
    """Return a walker whose way is not known yet."""
    walker = Walker()
    walker.slot = slot
    walker.at = at
    walker.goal = goal
    walker.ahead = at
    walker.left = 0.0
    walker.found = False
    walker.arrives = False
    walker.settled = False
    return walker


class Flow:
    """A grid around walkers; ``stand`` and ``reach`` say what is on it, ``find`` finds the ways."""

    def cover(self, grid: SurfaceGrid, walkers: list[Walker]) -> None:
        """Lay the grid around walkers, with nothing on it yet."""
        first: Walker = walkers[0]
        low = first.at
        high = first.at
        for walker in walkers:
            low = memory.point(min(low.x, walker.at.x), min(low.y, walker.at.y))
            high = memory.point(max(high.x, walker.at.x), max(high.y, walker.at.y))
        x0 = int(math.floor(low.x + (grid.shift - MARGIN)))
        y0 = int(math.floor(low.y + (grid.shift - MARGIN)))
        x1 = int(math.ceil(high.x + (grid.shift + MARGIN)))
        y1 = int(math.ceil(high.y + (grid.shift + MARGIN)))
        self.low = memory.point(x0 - grid.shift, y0 - grid.shift)
        self.width = (x1 - x0) * FINE
        self.height = (y1 - y0) * FINE
        size = self.width * self.height
        self.arrays: tuple[NDArray[Any], ...] = (
            memory.new_uint8s(size), memory.new_uint8s(size), memory.new_uint8s(size),
            memory.new_ints(size), memory.new_ints(size),
        )  # fmt: skip
        self.left = memory.uint8s(self.arrays[0])  # steps to a place to go to; ``NOWHERE`` or ``TAKEN``
        self.wanted = memory.uint8s(self.arrays[1])
        self.awaited = memory.uint8s(self.arrays[2])  # the cells around walkers
        self.goals = memory.ints(self.arrays[3])  # the wanted cells
        self.reached = memory.ints(self.arrays[4])  # cells in the order of their steps
        self.goal_count = 0
        self.end = 0  # of the cells that were reached
        self.lay_ground(grid, x0, y0)

    def lay_ground(self, grid: SurfaceGrid, x0: int, y0: int) -> None:
        """Free the cells on free ground, but none at the edge, so that no step leads round it.

        Args:
            grid: The ground.
            x0: The column of the ground at which the grid begins.
            y0: The row of the ground at which it does.
        """
        memory.fill(self.left, 0, self.width * self.height, TAKEN)
        for y in range(max(-y0, 0), min(self.height // FINE, grid.height - y0)):
            row = y * FINE * self.width
            for x in range(max(-x0, 0), min(self.width // FINE, grid.width - x0)):
                if grid.flat[(y0 + y) * grid.width + x0 + x]:
                    memory.fill(self.left, row + x * FINE, FINE, NOWHERE)
            self.left[row] = TAKEN
            self.left[row + self.width - 1] = TAKEN
            for line in range(1, FINE):
                memory.repeat(self.left, row, self.width, row + line * self.width)
        memory.fill(self.left, 0, self.width, TAKEN)
        memory.fill(self.left, (self.height - 1) * self.width, self.width, TAKEN)

    def stand(self, at: memory.Point, apart: float) -> None:
        """Take the cells nearer than ``apart`` to a body."""
        self.paint(at, apart, False)

    def reach(self, at: memory.Point, within: float) -> None:
        """Mark the cells within a distance of a target as places to go to."""
        self.paint(at, within, True)

    def paint(self, at: memory.Point, radius: float, wanted: bool) -> None:
        """Take the cells around a point, or mark them as wanted."""
        middle_x = (at.x - self.low.x) * FINE
        middle_y = (at.y - self.low.y) * FINE
        radius = radius * FINE
        half = int(math.ceil(radius))
        column = int(math.floor(middle_x))
        row = int(math.floor(middle_y))
        for i in range(max(row - half, 0), min(row + half + 1, self.height)):
            y = i + 0.5 - middle_y
            for j in range(max(column - half, 0), min(column + half + 1, self.width)):
                x = j + 0.5 - middle_x
                if x * x + y * y >= radius * radius:
                    continue
                cell = i * self.width + j
                if not wanted:
                    self.left[cell] = TAKEN
                elif not self.wanted[cell]:
                    self.wanted[cell] = 1
                    self.goals[self.goal_count] = cell
                    self.goal_count += 1

    def find(self, walkers: list[Walker], width: float) -> None:
        """Write the points ``ahead`` that walkers head for, and which of them have a way.

        Of ways that are equally short each takes the one that leads nearer to its goal. Where a walker is about to
        arrive others of its ``width`` find no room, and go on to the next place.
        """
        if not self.spread(walkers):
            return
        for walker in walkers:
            walker.ahead = self.look_ahead(walker)
            walker.left = memory.length(walker.ahead.x - walker.at.x, walker.ahead.y - walker.at.y)
        settled = _settle(walkers, width)
        if not 0 < settled < len(walkers):
            return
        for walker in walkers:
            if walker.settled:
                self.stand(walker.ahead, width)
        self.spread(walkers)
        for walker in walkers:
            if not walker.settled:
                before = walker.found
                ahead = self.look_ahead(walker)
                if walker.found:
                    walker.ahead = ahead
                walker.found = before

    def cell(self, at: memory.Point) -> int:
        """Return the cell under a point of the grid."""
        x = int((at.x - self.low.x) * FINE)
        y = int((at.y - self.low.y) * FINE)
        return y * self.width + x

    def spread(self, walkers: list[Walker]) -> bool:
        """Count the steps from each cell to a place to go to, outwards until those that go on are reached.

        Returns whether there is such a place.
        """
        self.forget_count(walkers)
        missing = 0
        for walker in walkers:
            if not walker.settled:
                missing += self.await_around(walker, True)
        for i in range(self.goal_count):
            missing -= self.arrive(self.goals[i], 0)
        old = 0
        older = 0
        for step in range(1, NOWHERE):
            if missing == 0:
                break
            stop = self.end
            for i in range(old, stop):
                cell = self.reached[i]
                missing -= self.arrive(cell - 1, step) + self.arrive(cell + 1, step)
                missing -= self.arrive(cell - self.width, step) + self.arrive(cell + self.width, step)
            if step % 2 == 1:  # a diagonal every second step: about as long as it looks
                for i in range(older, stop):
                    cell = self.reached[i] - self.width
                    missing -= self.arrive(cell - 1, step) + self.arrive(cell + 1, step)
                    cell = self.reached[i] + self.width
                    missing -= self.arrive(cell - 1, step) + self.arrive(cell + 1, step)
            if self.end == stop:
                break
            older = old
            old = stop
        return self.end > 0

    def forget_count(self, walkers: list[Walker]) -> None:
        """Undo what an earlier count has written."""
        for i in range(self.end):
            if self.left[self.reached[i]] != TAKEN:
                self.left[self.reached[i]] = NOWHERE
        self.end = 0
        for walker in walkers:
            self.await_around(walker, False)

    def await_around(self, walker: Walker, awaited: bool) -> int:
        """Await the free cells around a walker, or no longer; return how many that changes."""
        changed = 0
        middle = self.cell(walker.at)
        for y in range(-1, 2):
            for x in range(-1, 2):
                cell = middle + y * self.width + x
                if self.awaited[cell] != awaited and (not awaited or self.left[cell] != TAKEN):
                    self.awaited[cell] = awaited
                    changed += 1
        return changed

    def arrive(self, cell: int, step: int) -> int:
        """Note that a cell is reached now, if it is free and was not before; return how many awaited ones that are."""
        if self.left[cell] != NOWHERE:
            return 0
        self.left[cell] = step
        self.reached[self.end] = cell
        self.end += 1
        return self.awaited[cell]

    def look_ahead(self, walker: Walker) -> memory.Point:
        """Return the point some steps ahead; write whether there is a way, and whether it ends there."""
        cell = self.cell(walker.at)
        x = cell % self.width
        y = cell // self.width
        goal_x = (walker.goal.x - self.low.x) * FINE - 0.5
        goal_y = (walker.goal.y - self.low.y) * FINE - 0.5
        for hop in range(HOPS + 1):
            best = math.inf
            best_x = x
            best_y = y
            for dy in range(-AROUND, AROUND + 1):
                beside_y = (y - goal_y) + dy
                for dx in range(-AROUND, AROUND + 1):
                    beside_x = (x - goal_x) + dx
                    cost = beside_y * beside_y + beside_x * beside_x
                    cost = min(self.left[(y + dy) * self.width + x + dx], NOWHERE) + NEARER * cost
                    if cost < best:
                        best = cost
                        best_x = x + dx
                        best_y = y + dy
            x = best_x
            y = best_y
            if hop == 0:
                walker.found = self.left[y * self.width + x] < NOWHERE
        walker.arrives = self.left[y * self.width + x] == 0
        return memory.point((x + 0.5) / FINE + self.low.x, (y + 0.5) / FINE + self.low.y)


def flow_around(grid: SurfaceGrid, walkers: list[Walker]) -> Flow:
    """Return a grid around walkers, with nothing on it yet."""
    flow = Flow()
    flow.cover(grid, walkers)
    return flow


def _settle(walkers: list[Walker], width: float) -> int:
    """Write which walkers arrive where no walker nearer to its place does; return how many do."""
    settled = 0
    for walker in walkers:
        walker.settled = walker.arrives
        for rival in walkers:
            if not walker.settled:
                break
            if rival.arrives and rival.left < walker.left and _are_near(walker, rival, width):
                walker.settled = False
        if walker.settled:
            settled += 1
    return settled


def _are_near(walker: Walker, rival: Walker, width: float) -> bool:
    """Return whether the places of two walkers are nearer to each other than a distance."""
    x = walker.ahead.x - rival.ahead.x
    y = walker.ahead.y - rival.ahead.y
    return x * x + y * y < width * width
