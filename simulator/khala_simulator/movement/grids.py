"""Grids: the cells of a surface as the rules read them, and straight lines over it.

``pathfinding`` makes the surfaces; ``ways`` finds ways round corners.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala_simulator.movement import pathfinding
from khala_simulator.native import memory
from khala_simulator.tables.layers import Layer

if TYPE_CHECKING:
    from khala_simulator.movement.pathfinding import Surface
    from khala_simulator.world.ground import BuiltGround

SIDE_CLEARANCE: Final = 0.3
SAMPLE_STEP: Final = 0.35


class SurfaceGrid:
    """The cells of one surface, row by row; they never change.

    Attributes:
        surface: The surface, whose arrays these are: it has what is rare, and says what they hold.
        fields_kept: How many of ``fields`` are kept.
        fields: The shortest ways that are known, by the cell to which they lead.
        spikes: For each corner of a cell, whether only the diagonal neighbour is blocked there.
        corners: Where these corners are in the cell.
    """

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self.fields_kept = surface.fields_kept
        self.fields: dict[int, Any] = {}
        self.height, self.width = surface.free.shape
        self.shift = surface.shift
        self.flat = memory.bools(surface.flat)
        self.open = memory.bools(surface.open)
        self.part = memory.ints(surface.part)
        self.sums = memory.ints(surface.sums)
        self.steps = memory.uint8s(surface.steps)
        self.walls_low = memory.points(surface.walls_low)
        self.walls_high = memory.points(surface.walls_high)
        self.spiked = memory.bools(surface.spiked)
        self.spikes = [
            memory.bools(surface.spikes[0][1]),
            memory.bools(surface.spikes[1][1]),
            memory.bools(surface.spikes[2][1]),
            memory.bools(surface.spikes[3][1]),
        ]
        self.spike_corners = np.array([corner for corner, _ in surface.spikes])
        self.corners = memory.points(self.spike_corners)

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Return what makes None: a copy of a surface is read anew."""
        return type(None), ()


def read(surface: Surface) -> SurfaceGrid:
    """Return the grid of a surface."""
    if surface.grid is None:
        surface.grid = SurfaceGrid(surface)
    grid: SurfaceGrid = surface.grid  # type: ignore[assignment]  # a surface does not know its grid
    return grid


def grid_of(ground: BuiltGround, layer: int) -> SurfaceGrid:
    """Return the grid that units of a layer move on now."""
    grid = ground.grids[layer]
    if grid is None:
        grid = read(pathfinding.surface(ground, Layer(layer)))
        ground.grids[layer] = grid
    return grid  # type: ignore[return-value]  # the ground does not know its grids


def cell_at(grid: SurfaceGrid, x: float, y: float) -> int:
    """Return the cell under a point; a point outside counts as the nearest cell inside."""
    column = int(x + grid.shift)
    row = int(y + grid.shift)
    column = 0 if column < 0 else grid.width - 1 if column >= grid.width else column
    row = 0 if row < 0 else grid.height - 1 if row >= grid.height else row
    return row * grid.width + column


def centre_of(grid: SurfaceGrid, cell: int) -> memory.Point:
    """Return the centre of a cell."""
    row = cell // grid.width
    return memory.point(cell - row * grid.width + (0.5 - grid.shift), row + (0.5 - grid.shift))


# lines ----------------------------------------------------------------------------------------------------------------


class Lines:
    """Straight lines.

    Attributes:
        count: How many there are.
        ends: Where each starts and where it ends, one line after the other.
        free: Whether a body of ordinary width gets from the start of each to its end.
    """

    def __init__(self, room: int) -> None:
        self.count = 0
        self.arrays = (memory.new_points(2 * room), memory.new_bools(room))
        self.ends = memory.points(self.arrays[0])
        self.free = memory.bools(self.arrays[1])

    def add(self, start: memory.Point, end: memory.Point) -> None:
        """Add a line."""
        self.ends[2 * self.count] = start
        self.ends[2 * self.count + 1] = end
        self.count += 1


def clear(grid: SurfaceGrid, lines: Lines) -> None:
    """Write which of the lines are free; all that are not obviously so are sampled as finely as the longest needs."""
    longest = -1.0
    for i in range(lines.count):
        start = lines.ends[2 * i]
        end = lines.ends[2 * i + 1]
        lines.free[i] = _box_is_free(grid, start, end)
        if not lines.free[i]:
            longest = max(longest, memory.length(end.x - start.x, end.y - start.y))
    if longest < 0.0:
        return
    samples = _floor(longest / SAMPLE_STEP) + 2
    for i in range(lines.count):
        if not lines.free[i]:
            lines.free[i] = _sides_are_free(grid, lines.ends[2 * i], lines.ends[2 * i + 1], samples)


def _box_is_free(grid: SurfaceGrid, start: memory.Point, end: memory.Point) -> bool:
    """Return whether all cells of the box around a line are free."""
    inward = grid.shift - SIDE_CLEARANCE
    outward = grid.shift + SIDE_CLEARANCE
    left = max(_floor(min(start.x, end.x) + inward), 0)
    low = max(_floor(min(start.y, end.y) + inward), 0)
    right = min(_floor(max(start.x, end.x) + outward) + 1, grid.width)
    high = min(_floor(max(start.y, end.y) + outward) + 1, grid.height)
    if left > right or low > high:  # off the map
        return False
    below = low * (grid.width + 1)
    above = high * (grid.width + 1)
    free = grid.sums[above + right] - grid.sums[below + right] - grid.sums[above + left] + grid.sums[below + left]
    return free == (right - left) * (high - low)


def _floor(x: float) -> int:
    return int(math.floor(x))


def _sides_are_free(grid: SurfaceGrid, start: memory.Point, end: memory.Point, samples: int) -> bool:
    """Return whether both sides of a line are free at so many places along it."""
    x = end.x - start.x
    y = end.y - start.y
    scale = SIDE_CLEARANCE / max(memory.length(x, y), SIDE_CLEARANCE)
    side_x = -y * scale
    side_y = x * scale
    step = 1.0 / (samples - 1)
    for i in range(samples):
        share = 1.0 if i == samples - 1 else i * step
        at_x = start.x + x * share
        at_y = start.y + y * share
        if not grid.flat[cell_at(grid, at_x + side_x, at_y + side_y)]:
            return False
        if not grid.flat[cell_at(grid, at_x - side_x, at_y - side_y)]:
            return False
    return True
