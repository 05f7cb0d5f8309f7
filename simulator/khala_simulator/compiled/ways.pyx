"""Lines and shortest ways over a surface, compiled; `movement.pathfinding` has the rules."""
cimport cython
cimport numpy as cnp
from libc.math cimport INFINITY, floor
from libc.stdint cimport int64_t, uint8_t
from libc.stdlib cimport calloc, free, malloc, realloc

from khala_simulator.native.memory cimport Point
from khala_simulator.compiled.numbers cimport floats, least, length, most, new_floats
from khala_simulator.compiled.surfaces cimport Grid, cell_at, centre_of

import math

import numpy as np

from khala_simulator.movement import pathfinding as rules

cnp.import_array()

cdef double SIDE_CLEARANCE = rules.SIDE_CLEARANCE
cdef double SAMPLE_STEP = rules.SAMPLE_STEP
cdef enum:
    AHEAD = 8
    NEIGHBOURS = 8
cdef int64_t[AHEAD] LOOK_AHEAD = rules.LOOK_AHEAD
cdef int64_t[NEIGHBOURS] STEP_X
cdef int64_t[NEIGHBOURS] STEP_Y
cdef double[NEIGHBOURS] COST
for _i, (_x, _y) in enumerate(rules.NEIGHBOURS):
    STEP_X[_i], STEP_Y[_i], COST[_i] = _x, _y, math.sqrt(_x * _x + _y * _y)


# lines ----------------------------------------------------------------------------------------------------------------


cdef int clear(Grid grid, Line* lines, Py_ssize_t n) except -1:
    """Write which of the lines are free; all that are not obviously so are sampled as finely as the longest needs."""
    cdef Py_ssize_t i, samples
    cdef double longest = -1.0
    cdef Line* line
    for i in range(n):
        line = &lines[i]
        if not on_map(grid, line):
            by_rule(grid, lines, n)
            return 0
        line.free = box_is_free(grid, line)
        if not line.free:
            longest = most(longest, length(line.end.x - line.start.x, line.end.y - line.start.y))
    if longest >= 0.0:
        samples = <int64_t>(longest / SAMPLE_STEP) + 2
        for i in range(n):
            if not lines[i].free:
                lines[i].free = sampled(grid, &lines[i], samples)
    return 0


cdef bint on_map(Grid grid, Line* line) noexcept:
    """Return whether a line lies on the map, where every cell below has a number."""
    return (
        least(line.start.x, line.end.x) + grid.shift >= 0.0
        and least(line.start.y, line.end.y) + grid.shift >= 0.0
        and most(line.start.x, line.end.x) + grid.shift <= grid.width
        and most(line.start.y, line.end.y) + grid.shift <= grid.height
    )


cdef by_rule(Grid grid, Line* lines, Py_ssize_t n):
    """Do the same for lines of which some leave the map."""
    cdef Py_ssize_t i
    starts, ends = np.empty((n, 2)), np.empty((n, 2))
    for i in range(n):
        starts[i], ends[i] = (lines[i].start.x, lines[i].start.y), (lines[i].end.x, lines[i].end.y)
    for i, free in enumerate(grid.surface.clear(starts, ends).tolist()):
        lines[i].free = free


cdef bint box_is_free(Grid grid, Line* line) noexcept:
    """Return whether all cells of the box around a line are free."""
    cdef double inward = grid.shift - SIDE_CLEARANCE, outward = grid.shift + SIDE_CLEARANCE
    cdef int64_t left = <int64_t>floor(least(line.start.x, line.end.x) + inward)
    cdef int64_t low = <int64_t>floor(least(line.start.y, line.end.y) + inward)
    cdef int64_t right = <int64_t>floor(most(line.start.x, line.end.x) + outward) + 1
    cdef int64_t high = <int64_t>floor(most(line.start.y, line.end.y) + outward) + 1
    left, low, right, high = max(left, 0), max(low, 0), min(right, grid.width), min(high, grid.height)
    cdef int64_t* below = grid.sums + low * (grid.width + 1)
    cdef int64_t* above = grid.sums + high * (grid.width + 1)
    return above[right] - below[right] - above[left] + below[left] == (right - left) * (high - low)


cdef bint sampled(Grid grid, Line* line, Py_ssize_t samples) noexcept:
    """Return whether both sides of a line are free at so many places along it."""
    cdef double x = line.end.x - line.start.x, y = line.end.y - line.start.y, share
    cdef double scale = SIDE_CLEARANCE / most(length(x, y), SIDE_CLEARANCE), step = 1.0 / (samples - 1)
    cdef double side_x = -y * scale, side_y = x * scale
    cdef Point at
    cdef Py_ssize_t i
    for i in range(samples):
        share = 1.0 if i == samples - 1 else i * step
        at.x, at.y = line.start.x + x * share, line.start.y + y * share
        if not grid.flat[cell_at(grid, at.x + side_x, at.y + side_y)]:
            return False
        if not grid.flat[cell_at(grid, at.x - side_x, at.y - side_y)]:
            return False
    return True


# ways -----------------------------------------------------------------------------------------------------------------


cdef int find_corners(Grid grid, Way* ways, Py_ssize_t n) except -1:
    """Write how far ahead (``near``) on its way to its goal each walker gets straight; found by halving."""
    cdef Py_ssize_t i, unsure
    cdef int64_t step
    cdef Way* way
    cdef Field field = None
    cdef cnp.ndarray room = new_floats(n * <Py_ssize_t>(sizeof(Line) // sizeof(double)))
    cdef Line* lines = <Line*>floats(room)
    for i in range(n):
        way = &ways[i]
        if field is None or field.goal != way.goal:
            field = field_of(grid, way.goal)
        field.follow(grid, cell_at(grid, way.start.x, way.start.y), way.ahead)
        way.near, way.far = 0, AHEAD - 1
    first = True
    while True:
        unsure = 0
        for i in range(n):
            way = &ways[i]
            if way.near < way.far:
                lines[unsure].start = way.start
                lines[unsure].end = centre_of(grid, way.ahead[AHEAD - 1 if first else middle(way)])
                unsure += 1
        if not unsure:
            return 0
        clear(grid, lines, unsure)
        unsure = 0
        for i in range(n):
            way = &ways[i]
            if way.near < way.far:
                step = AHEAD - 1 if first else middle(way)
                if lines[unsure].free:
                    way.near = step
                else:
                    way.far = step - 1
                unsure += 1
        first = False


cdef inline int64_t middle(Way* way) noexcept:
    """Return which step ahead is looked at next."""
    return (way.near + way.far + 1) // 2


cdef Field field_of(Grid grid, int64_t goal):
    """Return the ways to a goal."""
    found = grid.fields.get(goal)
    if found is None:
        if len(grid.fields) >= grid.fields_kept:
            grid.fields.clear()
        found = grid.fields[goal] = Field(goal, grid.width * grid.height)
    return <Field>found


cdef struct Step:
    double distance
    int64_t cell


@cython.final
cdef class Field:
    """The shortest ways to one goal, searched outwards only as far as requested (Dijkstra)."""

    cdef int64_t goal
    cdef double* distance
    cdef int64_t* towards
    cdef uint8_t* settled
    cdef Step* heap
    cdef Py_ssize_t size  # of the heap
    cdef Py_ssize_t room

    def __cinit__(self, int64_t goal, Py_ssize_t cells):
        cdef Py_ssize_t i
        self.goal = goal
        self.distance = <double*>malloc(cells * sizeof(double))
        self.towards = <int64_t*>malloc(cells * sizeof(int64_t))
        self.settled = <uint8_t*>calloc(cells, 1)
        if self.distance == NULL or self.towards == NULL or self.settled == NULL:
            raise MemoryError("no room for the ways to a goal")
        for i in range(cells):
            self.distance[i] = INFINITY
            self.towards[i] = i
        self.distance[goal] = 0.0
        self.push(0.0, goal)

    def __dealloc__(self):
        free(self.distance)
        free(self.towards)
        free(self.settled)
        free(self.heap)

    cdef int follow(self, Grid grid, int64_t cell, int64_t* ahead) except -1:
        """Write the cells some steps along the way from a cell."""
        cdef int i
        cdef int64_t at = 0
        if not self.settled[cell]:
            self.reach(grid, cell)
        for i in range(AHEAD):
            while at < LOOK_AHEAD[i]:
                cell = self.towards[cell]
                at += 1
            ahead[i] = cell
        return 0

    cdef int reach(self, Grid grid, int64_t wanted) except -1:
        """Go on until a cell is settled or nothing is left to settle."""
        cdef Step step
        cdef int i
        cdef int64_t neighbour
        cdef double further
        while self.size and not self.settled[wanted]:
            step = self.pop()
            if self.settled[step.cell]:
                continue
            self.settled[step.cell] = 1
            for i in range(NEIGHBOURS):
                if grid.steps[step.cell] >> i & 1:
                    neighbour = step.cell + STEP_Y[i] * grid.width + STEP_X[i]
                    further = step.distance + COST[i]
                    if further < self.distance[neighbour]:
                        self.distance[neighbour] = further
                        self.towards[neighbour] = step.cell
                        self.push(further, neighbour)
        return 0

    cdef int push(self, double distance, int64_t cell) except -1:
        """Note that a cell may be so far away."""
        cdef Py_ssize_t at = self.size, above
        if self.size == self.room:
            self.room = 2 * self.room + 256
            self.heap = <Step*>realloc(self.heap, self.room * sizeof(Step))
            if self.heap == NULL:
                raise MemoryError("no room for the ways to a goal")
        self.size += 1
        self.heap[at].distance, self.heap[at].cell = distance, cell
        while at > 0:
            above = (at - 1) // 2
            if not before(&self.heap[at], &self.heap[above]):
                break
            self.heap[at], self.heap[above] = self.heap[above], self.heap[at]
            at = above
        return 0

    cdef Step pop(self) noexcept:
        """Take out the nearest cell, of equally near ones the first."""
        cdef Step nearest = self.heap[0]
        cdef Py_ssize_t at = 0, below
        self.size -= 1
        self.heap[0] = self.heap[self.size]
        while True:
            below = 2 * at + 1
            if below >= self.size:
                return nearest
            if below + 1 < self.size and before(&self.heap[below + 1], &self.heap[below]):
                below += 1
            if not before(&self.heap[below], &self.heap[at]):
                return nearest
            self.heap[at], self.heap[below] = self.heap[below], self.heap[at]
            at = below


cdef inline bint before(Step* one, Step* other) noexcept:
    return one.distance < other.distance or one.distance == other.distance and one.cell < other.cell
