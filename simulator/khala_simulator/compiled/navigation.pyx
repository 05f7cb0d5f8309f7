"""Navigation, compiled; `systems.navigation` has the rules."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.native.memory cimport Point
from khala_simulator.compiled.numbers cimport count, floats, ints, least, length, most, new_floats, new_ints
from khala_simulator.compiled.surfaces cimport Grid, cell_at, centre_of, grid_of
from khala_simulator.compiled.ways cimport Line, Way, clear, find_corners

from khala_simulator.movement import pathfinding
from khala_simulator.systems import navigation as rules
from khala_simulator.tables.mechanics import MECHANICS

cnp.import_array()

cdef double CORNER_REACHED_SQUARED = rules.CORNER_REACHED**2
cdef double NEAR_CORNER = rules.NEAR_CORNER
cdef double HEADWAY = rules.HEADWAY
cdef double NEAR_SIDE = pathfinding.NEAR_SIDE
cdef int64_t LOOK_PERIOD = rules.LOOK_PERIOD
cdef int64_t PATH_PERIOD = MECHANICS.path_period
cdef int64_t LAYERS = len(rules.LAYERS)
cdef int64_t AIR = rules.AIR


def find_ways(world):
    """Write ``nav_point`` of every unit that wants to move; ways are checked every few loops."""
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t n = world.top, slot, due = 0, i, many
    cdef int64_t loop = world.loop, latest = loop if loop % LOOK_PERIOD == 0 else 0, layer
    cdef bint soon
    cdef cnp.ndarray walkers, chosen
    for slot in range(n):
        if c.wants[slot]:
            if c.nav_straight[slot]:
                c.nav_point[slot] = c.goal[slot]
            due += c.nav_loop[slot] <= latest
    if not due:
        return
    walkers, chosen, due = new_ints(due), new_ints(due), 0
    for slot in range(n):
        if c.wants[slot] and c.nav_loop[slot] <= latest:
            ints(walkers)[due] = slot
            due += 1
    for layer in range(LAYERS):
        many = 0
        for i in range(due):
            if c.layer[ints(walkers)[i]] == layer:
                ints(chosen)[many] = ints(walkers)[i]
                many += 1
        if many:
            look_over(world, c, ints(chosen), many, layer)
    for i in range(due):
        slot = ints(walkers)[i]
        soon = not c.nav_straight[slot] and away(c.nav_point[slot], c.pos[slot]) < NEAR_CORNER
        c.nav_loop[slot] = loop + (LOOK_PERIOD if soon else PATH_PERIOD)


cdef inline double away(Point one, Point other) noexcept:
    """Return the distance between two points."""
    return length(one.x - other.x, one.y - other.y)


cdef look_over(world, Columns c, int64_t* slots, Py_ssize_t n, int64_t layer):
    """Find out which walkers of a layer get straight to their goals, and the corners of the others' ways."""
    cdef cnp.ndarray room
    cdef Line* lines
    cdef Grid grid
    cdef Py_ssize_t i, crooked = 0
    cdef int64_t slot
    cdef double left
    for i in range(n):
        slot = slots[i]
        c.nav_straight[slot], c.nav_end[slot] = True, False
        c.nav_point[slot] = c.nav_goal[slot] = c.goal[slot]
    if layer != AIR:
        room = new_floats(n * <Py_ssize_t>(sizeof(Line) // sizeof(double)))
        lines = <Line*>floats(room)
        grid = grid_of(world.ground, layer)
        for i in range(n):
            lines[i].start, lines[i].end = c.pos[slots[i]], stopping_point(c, slots[i])
        clear(grid, lines, n)
        for i in range(n):
            c.nav_straight[slots[i]] = lines[i].free
            crooked += not lines[i].free
        if crooked:
            go_round(world, c, grid, slots, n, crooked)
    for i in range(n):
        slot = slots[i]
        left = away(c.nav_goal[slot], c.pos[slot])
        if c.nav_loop[slot] == 0 or left < c.nav_best[slot] - HEADWAY:
            c.nav_best[slot], c.nav_best_loop[slot] = left, world.loop


cdef Point stopping_point(Columns c, int64_t slot) noexcept:
    """Return where a unit would stop on a straight way; a target on a footprint is reached from beside it."""
    cdef double x = c.pos[slot].x - c.goal[slot].x, y = c.pos[slot].y - c.goal[slot].y
    cdef double share = least(c.stop_at[slot] / most(length(x, y), 1e-12), 1.0)
    cdef Point point
    point.x, point.y = c.goal[slot].x + x * share, c.goal[slot].y + y * share
    return point


cdef go_round(world, Columns c, Grid grid, int64_t* slots, Py_ssize_t n, Py_ssize_t crooked):
    """Send walkers whose straight line is not free to the next corner of their way."""
    cdef cnp.ndarray room = new_floats(crooked * <Py_ssize_t>(sizeof(Way) // sizeof(double)))
    cdef cnp.ndarray walkers = new_ints(crooked)
    cdef Way* ways = <Way*>floats(room)
    cdef Py_ssize_t i, usable = 0
    cdef int64_t slot, part, goal
    cdef Point centre
    for i in range(n):
        slot = slots[i]
        if c.nav_straight[slot]:
            continue
        part = grid.part[cell_at(grid, c.pos[slot].x, c.pos[slot].y)]
        if part < 0:
            continue
        goal = cell_at(grid, c.goal[slot].x, c.goal[slot].y)
        if grid.part[goal] != part:
            goal = nearest(grid, world.goal[slot], part, c.pos[slot])
            c.nav_goal[slot] = centre_of(grid, goal)
        ways[usable].start, ways[usable].goal = c.pos[slot], goal
        ints(walkers)[usable] = slot
        usable += 1
    find_corners(grid, ways, usable)
    for i in range(usable):
        slot = ints(walkers)[i]
        if cell_at(grid, c.pos[slot].x, c.pos[slot].y) == ways[i].goal:
            centre = c.nav_point[slot] = centre_of(grid, ways[i].goal)
            centre.x -= c.pos[slot].x
            centre.y -= c.pos[slot].y
            c.nav_end[slot] = centre.x * centre.x + centre.y * centre.y < CORNER_REACHED_SQUARED
        else:
            c.nav_point[slot] = centre_of(grid, ways[i].ahead[ways[i].near])


cdef int64_t nearest(Grid grid, point, int64_t part, Point start) except -1:
    """Return the cell of a connected part nearest to a point; the side of the start decides near ties."""
    cdef cnp.ndarray cells, distance
    cells, distance = grid.surface.around(point, part)
    cdef Py_ssize_t i, best = 0
    cdef double cost, least_cost = 0.0
    for i in range(count(cells)):
        cost = floats(distance)[i] + NEAR_SIDE * away(centre_of(grid, ints(cells)[i]), start)
        if i == 0 or cost < least_cost:
            best, least_cost = i, cost
    return ints(cells)[best]
