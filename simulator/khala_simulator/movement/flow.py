"""Flow: the ways of a crowd round the bodies that stand, to the free places from which it reaches its targets.

A ``Flow`` is a fine grid over a fight: where a body of one size has room, and how many steps it is from there to the
nearest place in reach of a target. It is found outwards from those places, a step at a time, on whole grids at once:
a grid is one integer, a bit for each cell. ``systems.flanking`` follows it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some, which

if TYPE_CHECKING:
    from khala_simulator.movement.pathfinding import Surface
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.columns import Bools, Ints

Bytes = NDArray[np.uint8]

FINE: Final = 4  # cells of the grid in a cell of the ground, on each axis
MARGIN: Final = 4.0  # how far beyond the crowd its ways may lead; no hop leads out of the grid
DIGITS: Final = 6
NOWHERE: Final = 2**DIGITS - 1  # more steps than are looked at
HOPS: Final = 2  # of up to two cells, from the nearest cell with a way to the point that a walker heads for
NEARER: Final = 1e-5  # what a square cell of distance to the goal weighs, where a step weighs 1
SIDE: Final = np.arange(-2, 3)
AROUND: Final = np.array([(dx, dy) for dy in SIDE for dx in SIDE])
BESIDE: Final = AROUND[np.abs(AROUND).max(axis=1) < 2]  # the cell itself and its eight neighbours


class Flow:
    """A grid around walkers (k, 2); ``stand`` and ``reach`` say what is on it, ``points`` finds the ways."""

    def __init__(self, surface: Surface, walkers: Floats) -> None:
        low = np.floor(walkers.min(axis=0) + (surface.shift - MARGIN)).astype(np.int64)
        high = np.ceil(walkers.max(axis=0) + (surface.shift + MARGIN)).astype(np.int64)
        (x0, y0), (x1, y1) = low.tolist(), high.tolist()
        inside = surface.free[max(y0, 0) : y1, max(x0, 0) : x1]
        ground = np.zeros((y1 - y0, x1 - x0), dtype=np.bool_)
        ground[max(-y0, 0) :, max(-x0, 0) :][: inside.shape[0], : inside.shape[1]] = inside
        self.low = low - surface.shift
        self.free: Bools = ground.repeat(FINE, axis=0).repeat(FINE, axis=1)
        self.free[[0, -1]] = self.free[:, [0, -1]] = False  # so that no step leads round the edge
        self.wanted: Bools = np.zeros_like(self.free)
        self.height, self.width = self.free.shape

    def stand(self, at: Floats, apart: Floats) -> None:
        """Take the cells nearer than ``apart`` (m,) to bodies at (m, 2)."""
        self._paint(self.free, at, apart, value=False)

    def reach(self, at: Floats, within: Floats) -> None:
        """Mark the cells within a distance (m,) of targets at (m, 2) as places to go to."""
        self._paint(self.wanted, at, within, value=True)

    def _paint(self, grid: Bools, at: Floats, radius: Floats, *, value: bool) -> None:
        if not len(at):
            return
        at, radius = (at - self.low) * FINE, radius * FINE
        half = math.ceil(float(radius.max()))
        beside = (at > -half) & (at < (self.width + half, self.height + half))
        near = which(beside[:, 0] & beside[:, 1])
        at, radius = at.take(near, 0), radius.take(near)
        square = np.arange(-half, half + 1)
        x, dx = _columns(at[:, 0], square, self.width)
        y, dy = _columns(at[:, 1], square, self.height)
        inside = dx[:, None, :] + dy[:, :, None] < (radius * radius)[:, None, None]
        number = (y * self.width)[:, :, None] + x[:, None, :]
        grid.reshape(-1)[number.take(which(inside.ravel()))] = value

    def points(self, at: Floats, goal: Floats, width: float) -> tuple[Floats, Bools]:
        """Return the points (k, 2) that walkers at (k, 2) head for, and which of them have a way.

        Of ways that are equally short each takes the one that leads nearer to its goal (k, 2). Where a walker is about
        to arrive others of its ``width`` find no room, and go on to the next place.
        """
        if not np.count_nonzero(self.free & self.wanted):
            return at, np.zeros(len(at), dtype=np.bool_)
        points, found, arriving = self._ahead(at, goal)
        first = which(arriving)
        first = first[_without_overlap(points[first], geometry.length(points[first] - at[first]), width)]
        rest = np.ones(len(at), dtype=np.bool_)
        rest[first] = False
        if first.size and some(rest):
            self.stand(points[first], np.full(len(first), width))
            further, also, _ = self._ahead(at[rest], goal[rest])
            points[which(rest)[also]] = further[also]
        return points, found

    def _ahead(self, at: Floats, goal: Floats) -> tuple[Floats, Bools, Bools]:
        """Return the points some steps ahead (k, 2), who has a way, and whose ends there."""
        cells = ((at - self.low) * FINE).astype(np.int64)
        goal = (goal - self.low) * FINE - 0.5
        left = self._spread(cells)
        cell, steps = self._next(left, cells, goal)
        found = steps < NOWHERE
        for _ in range(HOPS):
            cell, steps = self._next(left, cell, goal)
        return (cell + 0.5) / FINE + self.low, found, steps == 0

    def _spread(self, cells: Ints) -> Bytes:
        """Return (cells,) the steps from each cell to a place to go to, ``NOWHERE`` if it was not reached.

        It ends as soon as the walkers' cells (k, 2) are reached. Each digit of the numbers is a grid by itself.
        """
        walkers = np.zeros(self.free.size, dtype=np.bool_)
        walkers[self._numbers(cells, BESIDE)] = True
        free, reached, missing = (_bits(g) for g in (self.free, self.free & self.wanted, self.free.ravel() & walkers))
        digits, width, step = [0] * DIGITS, self.width, 0
        while step < NOWHERE - 1 and missing & reached != missing:
            row = reached | reached << 1 | reached >> 1
            tall = reached if step % 2 else row  # a diagonal every second step: about as long as it looks
            grown = (row | tall << width | tall >> width) & free
            if grown == reached:
                break
            step += 1
            for digit in range((step & -step).bit_length()):
                digits[digit] ^= reached  # a digit turns at its multiples, in all cells that are not reached before
            reached = grown
        everywhere = (1 << self.free.size) - 1
        beyond, size = reached ^ everywhere, (self.free.size + 7) // 8
        packed = b"".join(
            (digits[d] ^ (everywhere if step >> d & 1 else 0) | beyond).to_bytes(size, "little") for d in range(DIGITS)
        )
        grids = np.unpackbits(np.frombuffer(packed, np.uint8).reshape(DIGITS, size), axis=1, bitorder="little")
        left: Bytes = np.add.reduce(grids << np.arange(DIGITS, dtype=np.uint8)[:, None], axis=0, dtype=np.uint8)
        return left

    def _next(self, left: Bytes, cells: Ints, goal: Floats) -> tuple[Ints, Bytes]:
        """Return (k, 2) the cell with the fewest steps left among those around, and how many that are."""
        steps = left.take(self._numbers(cells, AROUND))
        beside = (cells - goal)[:, :, None] + SIDE
        beside *= beside
        distance = (beside[:, 1, :, None] + beside[:, 0, None, :]).reshape(steps.shape)
        best = np.argmin(steps + NEARER * distance, axis=1)
        return cells + AROUND[best], steps[np.arange(len(cells)), best]

    def _numbers(self, cells: Ints, offsets: Ints) -> Ints:
        """Return (k, m) the numbers of the cells at offsets (m, 2) from others (k, 2)."""
        numbers: Ints = (cells[:, 1] * self.width + cells[:, 0])[:, None] + (offsets[:, 1] * self.width + offsets[:, 0])
        return numbers


def _columns(at: Floats, square: Ints, width: int) -> tuple[Ints, Floats]:
    """Return (m, s) the columns of a square around points (m,), and how far from them they are, squared."""
    columns = np.floor(at).astype(np.int64)[:, None] + square
    away = columns + 0.5 - at[:, None]
    away *= away
    away[(columns < 0) | (columns >= width)] = np.inf
    return columns, away


def _without_overlap(points: Floats, left: Floats, width: float) -> Bools:
    """Return which of the points (k, 2) have none within ``width`` whose walker has less of its way left."""
    offset = points[:, None, :] - points
    beaten = offset[..., 0] ** 2 + offset[..., 1] ** 2 < width * width
    beaten &= left < left[:, None]
    result: Bools = ~np.logical_or.reduce(beaten, axis=1)
    return result


def _bits(grid: Bools) -> int:
    return int.from_bytes(np.packbits(grid.ravel(), bitorder="little").tobytes(), "little")
