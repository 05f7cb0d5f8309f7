"""Navigation: the next corner on every walker's way, round cliffs and structures.

A unit whose straight line is free heads for its goal; the others follow the shortest way over the cells, cut short to
the farthest corner they can walk to straight. ``collision`` handles bodies in the way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.movement import grids, ways
from khala_simulator.movement.grids import Lines
from khala_simulator.movement.pathfinding import NEAR_SIDE
from khala_simulator.native import columns, memory
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from khala_simulator.movement.grids import SurfaceGrid
    from khala_simulator.movement.ways import Way
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.world import World

CORNER_REACHED: Final = 0.4
NEAR_CORNER: Final = 1.8
HEADWAY: Final = 0.25  # so much nearer to the goal counts as progress
NO_DISTANCE: Final = 1e-12
LOOK_PERIOD: Final = 4  # checking many at once costs little more than checking one
PATH_PERIOD: Final = MECHANICS.path_period
AIR: Final = int(Layer.AIR)
LAYERS: Final = len(Layer)


def find_ways(world: World) -> None:
    """Write ``nav_point`` of every unit that wants to move; ways are checked every few loops."""
    c = columns.columns_of(world)
    loop = world.loop
    latest = loop if loop % LOOK_PERIOD == 0 else 0
    due = 0
    for slot in range(world.top):
        if c.wants[slot]:
            if c.nav_straight[slot]:
                c.nav_point[slot] = c.goal[slot]
            due += c.nav_loop[slot] <= latest
    if due:
        _check(world, c, due, latest)


def _check(world: World, c: Columns, due: int, latest: int) -> None:
    """Check the ways of so many walkers, layer by layer."""
    rooms = (memory.new_ints(due), memory.new_ints(due))
    walkers = memory.ints(rooms[0])
    slots = memory.ints(rooms[1])
    i = 0
    for slot in range(world.top):
        if c.wants[slot] and c.nav_loop[slot] <= latest:
            walkers[i] = slot
            i += 1
    for layer in range(LAYERS):
        many = 0
        for i in range(due):
            if c.layer[walkers[i]] == layer:
                slots[many] = walkers[i]
                many += 1
        if many:
            _look_over(world, c, slots, many, layer)
    loop = world.loop
    for i in range(due):
        slot = walkers[i]
        soon = not c.nav_straight[slot] and _away(c.nav_point[slot], c.pos[slot]) < NEAR_CORNER
        c.nav_loop[slot] = loop + (LOOK_PERIOD if soon else PATH_PERIOD)


def _away(point: memory.Point, other: memory.Point) -> float:
    """Return the distance between two points."""
    return memory.length(point.x - other.x, point.y - other.y)


def _look_over(world: World, c: Columns, slots: Cells, n: int, layer: int) -> None:
    """Find out which walkers of a layer get straight to their goals, and the corners of the others' ways."""
    for i in range(n):
        slot = slots[i]
        c.nav_straight[slot] = True
        c.nav_end[slot] = False
        c.nav_point[slot] = c.goal[slot]
        c.nav_goal[slot] = c.goal[slot]
    if layer != AIR:
        _go_straight(world, c, slots, n, layer)
    loop = world.loop
    for i in range(n):
        slot = slots[i]
        left = _away(c.nav_goal[slot], c.pos[slot])
        if c.nav_loop[slot] == 0 or left < c.nav_best[slot] - HEADWAY:
            c.nav_best[slot] = left
            c.nav_best_loop[slot] = loop


def _go_straight(world: World, c: Columns, slots: Cells, n: int, layer: int) -> None:
    """Send walkers straight to their goals, and round corners where such a line is not free."""
    grid = grids.grid_of(world.ground, layer)
    lines = Lines(n)
    for i in range(n):
        lines.add(c.pos[slots[i]], _stopping_point(c, slots[i]))
    grids.clear(grid, lines)
    crooked = False
    for i in range(n):
        c.nav_straight[slots[i]] = lines.free[i]
        crooked |= not lines.free[i]
    if crooked:
        _go_round(world, c, grid, slots, n)


def _stopping_point(c: Columns, slot: int) -> memory.Point:
    """Return where a unit would stop on a straight way; a target on a footprint is reached from beside it."""
    x = c.pos[slot].x - c.goal[slot].x
    y = c.pos[slot].y - c.goal[slot].y
    share = min(c.stop_at[slot] / max(memory.length(x, y), NO_DISTANCE), 1.0)
    return memory.point(c.goal[slot].x + x * share, c.goal[slot].y + y * share)


def _go_round(world: World, c: Columns, grid: SurfaceGrid, slots: Cells, n: int) -> None:
    """Send walkers whose straight line is not free to the next corners of their ways."""
    crooked = []
    for i in range(n):
        slot = slots[i]
        if c.nav_straight[slot]:
            continue
        part = grid.part[grids.cell_at(grid, c.pos[slot].x, c.pos[slot].y)]
        if part < 0:
            continue
        goal = grids.cell_at(grid, c.goal[slot].x, c.goal[slot].y)
        if grid.part[goal] != part:
            goal = _nearest(grid, world.goal[slot], part, c.pos[slot])
            c.nav_goal[slot] = grids.centre_of(grid, goal)
        crooked.append(ways.way_from(slot, c.pos[slot], goal))
    ways.find_corners(grid, crooked)
    for way in crooked:
        _turn_corner(c, grid, way)


def _turn_corner(c: Columns, grid: SurfaceGrid, way: Way) -> None:
    """Send a walker to the next corner of its way, or to the middle of the last cell."""
    slot = way.walker
    if grids.cell_at(grid, c.pos[slot].x, c.pos[slot].y) != way.goal:
        c.nav_point[slot] = ways.corner_of(grid, way)
        return
    centre = grids.centre_of(grid, way.goal)
    c.nav_point[slot] = centre
    x = centre.x - c.pos[slot].x
    y = centre.y - c.pos[slot].y
    c.nav_end[slot] = x * x + y * y < CORNER_REACHED * CORNER_REACHED


def _nearest(grid: SurfaceGrid, point: Floats, part: int, start: memory.Point) -> int:
    """Return the cell of a connected part nearest to a point; the side of the start decides near ties."""
    found, distance = grid.surface.around(point, part)
    cells = memory.ints(found)
    distances = memory.floats(distance)
    best = 0
    least = 0.0
    for i in range(len(found)):
        cost = distances[i] + NEAR_SIDE * _away(grids.centre_of(grid, cells[i]), start)
        if i == 0 or cost < least:
            best = i
            least = cost
    return cells[best]
