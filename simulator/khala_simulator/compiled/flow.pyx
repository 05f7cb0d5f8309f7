"""Flow, compiled: the ways of a crowd round the bodies that stand; `movement.flow` has the rules."""
cimport cython
cimport numpy as cnp
from libc.math cimport INFINITY, ceil, floor
from libc.stdint cimport int64_t, uint8_t, uint64_t
from libc.stdlib cimport calloc, free, malloc
from libc.string cimport memcpy, memset

from khala_simulator.compiled.columns cimport Point, boolean
from khala_simulator.compiled.numbers cimport count, floats, least, length, most, new_floats, new_points
from khala_simulator.compiled.surfaces cimport Grid, read

import numpy as np

from khala_simulator.movement import flow as rules

cnp.import_array()

cdef enum:
    WORD = 8  # cells in a word
cdef int64_t FINE = rules.FINE
cdef double MARGIN = rules.MARGIN
cdef uint8_t NOWHERE = rules.NOWHERE
cdef int64_t HOPS = rules.HOPS
cdef double NEARER = rules.NEARER
cdef int64_t AROUND = rules.SIDE.max()

cdef struct Walker:
    Point at
    Point goal
    Point ahead  # the point that it heads for
    double left  # how far that is
    bint found  # whether there is a way
    bint arrives  # and ends there
    bint settled  # whether others go round that place


@cython.final
cdef class Flow:
    """A grid around walkers (k, 2); ``stand`` and ``reach`` say what is on it, ``points`` finds the ways."""

    cdef Point low
    cdef int64_t width
    cdef int64_t height
    cdef int64_t size  # of the grid, in cells
    cdef int64_t words
    cdef boolean* free
    cdef boolean* wanted
    cdef boolean* awaited  # the cells around walkers
    cdef uint8_t* left  # steps from each cell to a place to go to
    cdef int64_t* reached  # cells in the order of these

    def __cinit__(self, surface, cnp.ndarray walkers):
        cdef Grid grid = read(surface)
        cdef Point* at = <Point*>floats(walkers)
        cdef Point low = at[0], high = at[0]
        cdef Py_ssize_t i
        for i in range(count(walkers)):
            low.x, low.y = least(low.x, at[i].x), least(low.y, at[i].y)
            high.x, high.y = most(high.x, at[i].x), most(high.y, at[i].y)
        low.x, low.y = floor(low.x + (grid.shift - MARGIN)), floor(low.y + (grid.shift - MARGIN))
        high.x, high.y = ceil(high.x + (grid.shift + MARGIN)), ceil(high.y + (grid.shift + MARGIN))
        self.low.x, self.low.y = low.x - grid.shift, low.y - grid.shift
        self.width, self.height = <int64_t>(high.x - low.x) * FINE, <int64_t>(high.y - low.y) * FINE
        self.size = self.width * self.height
        self.words = (self.size + WORD - 1) // WORD
        self.free = <boolean*>calloc(self.words, WORD)
        self.wanted = <boolean*>calloc(self.words, WORD)
        self.awaited = <boolean*>malloc(self.size)
        self.left = <uint8_t*>malloc(self.size)
        self.reached = <int64_t*>malloc(self.size * sizeof(int64_t))
        if not (self.free and self.wanted and self.awaited and self.left and self.reached):
            raise MemoryError("no room for the ways of a crowd")
        self.stand_on(grid, <int64_t>low.x, <int64_t>low.y)

    cdef void stand_on(self, Grid grid, int64_t low_x, int64_t low_y) noexcept:
        """Free the cells on free ground, but none at the edge, so that no step leads round it."""
        cdef int64_t x, y, row, line
        for y in range(max(-low_y, 0), min(self.height // FINE, grid.height - low_y)):
            row = y * FINE * self.width
            for x in range(max(-low_x, 0), min(self.width // FINE, grid.width - low_x)):
                if grid.flat[(low_y + y) * grid.width + low_x + x]:
                    memset(self.free + row + x * FINE, True, FINE)
            self.free[row] = self.free[row + self.width - 1] = False
            for line in range(1, FINE):
                memcpy(self.free + row + line * self.width, self.free + row, self.width)
        memset(self.free, False, self.width)
        memset(self.free + self.size - self.width, False, self.width)

    def __dealloc__(self):
        free(self.free)
        free(self.wanted)
        free(self.awaited)
        free(self.left)
        free(self.reached)

    def stand(self, cnp.ndarray at, cnp.ndarray apart):
        """Take the cells nearer than ``apart`` (m,) to bodies at (m, 2)."""
        cdef Py_ssize_t i
        for i in range(count(at)):
            self.paint(self.free, (<Point*>floats(at))[i], floats(apart)[i], False)

    def reach(self, cnp.ndarray at, cnp.ndarray within):
        """Mark the cells within a distance (m,) of targets at (m, 2) as places to go to."""
        cdef Py_ssize_t i
        for i in range(count(at)):
            self.paint(self.wanted, (<Point*>floats(at))[i], floats(within)[i], True)

    cdef void paint(self, boolean* grid, Point at, double radius, boolean value) noexcept:
        """Write a value to the cells around a point."""
        cdef double x, y
        at.x, at.y, radius = (at.x - self.low.x) * FINE, (at.y - self.low.y) * FINE, radius * FINE
        cdef int64_t half = <int64_t>ceil(radius), column, row
        cdef int64_t middle_x = <int64_t>floor(at.x), middle_y = <int64_t>floor(at.y)
        for row in range(max(middle_y - half, 0), min(middle_y + half + 1, self.height)):
            y = row + 0.5 - at.y
            for column in range(max(middle_x - half, 0), min(middle_x + half + 1, self.width)):
                x = column + 0.5 - at.x
                if x * x + y * y < radius * radius:
                    grid[row * self.width + column] = value

    def points(self, cnp.ndarray at, cnp.ndarray goal, double width):
        """Return the points (k, 2) that walkers at (k, 2) head for, and which of them have a way.

        Of ways that are equally short each takes the one that leads nearer to its goal (k, 2). Where a walker is about
        to arrive others of its ``width`` find no room, and go on to the next place.
        """
        cdef Py_ssize_t i, k = count(at), settled = 0
        cdef cnp.ndarray room = new_floats(k * <Py_ssize_t>(sizeof(Walker) // sizeof(double)))
        cdef Walker* walkers = <Walker*>floats(room)
        cdef Walker* w
        cdef Walker other
        for i in range(k):
            w = &walkers[i]
            w.at, w.ahead, w.goal = (<Point*>floats(at))[i], (<Point*>floats(at))[i], (<Point*>floats(goal))[i]
            w.found = w.settled = False
        if self.spread(walkers, k):
            for i in range(k):
                w = &walkers[i]
                self.look_ahead(w)
                w.left = length(w.ahead.x - w.at.x, w.ahead.y - w.at.y)
            settled = settle(walkers, k, width)
            if 0 < settled < k:
                for i in range(k):
                    if walkers[i].settled:
                        self.paint(self.free, walkers[i].ahead, width, False)
                self.spread(walkers, k)
                for i in range(k):
                    other = walkers[i]
                    if not other.settled:
                        self.look_ahead(&other)
                        if other.found:
                            walkers[i].ahead = other.ahead
        cdef cnp.ndarray points = new_points(k)
        cdef cnp.ndarray found = np.empty(k, dtype=np.bool_)
        for i in range(k):
            (<Point*>floats(points))[i] = walkers[i].ahead
            (<boolean*>cnp.PyArray_DATA(found))[i] = walkers[i].found
        return points, found

    cdef int64_t cell(self, Point at) noexcept:
        """Return the cell under a point of the grid."""
        cdef int64_t x = <int64_t>((at.x - self.low.x) * FINE), y = <int64_t>((at.y - self.low.y) * FINE)
        return y * self.width + x

    cdef bint spread(self, Walker* walkers, Py_ssize_t k) noexcept:
        """Count the steps from each cell to a place to go to, outwards until those that go on are reached.

        Returns whether there is such a place.
        """
        cdef int64_t cell, x, y, missing = 0, word
        cdef int64_t end = 0, old = 0, older = 0, stop  # in ``reached``: its end, and where the last two steps begin
        cdef uint8_t step = 0
        cdef Py_ssize_t i
        memset(self.left, NOWHERE, self.size)
        memset(self.awaited, False, self.size)
        for i in range(k):
            if walkers[i].settled:
                continue
            for y in range(-1, 2):
                for x in range(-1, 2):
                    cell = self.cell(walkers[i].at) + y * self.width + x
                    missing += self.free[cell] and not self.awaited[cell]
                    self.awaited[cell] |= self.free[cell]
        for word in range(self.words):
            if (<uint64_t*>self.free)[word] & (<uint64_t*>self.wanted)[word] != 0:
                for cell in range(word * WORD, (word + 1) * WORD):
                    if self.wanted[cell]:
                        missing -= self.arrive(cell, 0, &end)
        while missing and step < NOWHERE - 1:
            step += 1
            stop = end
            for i in range(old, stop):
                cell = self.reached[i]
                missing -= self.arrive(cell - 1, step, &end) + self.arrive(cell + 1, step, &end)
                missing -= self.arrive(cell - self.width, step, &end) + self.arrive(cell + self.width, step, &end)
            if step % 2:  # a diagonal every second step: about as long as it looks
                for i in range(older, stop):
                    cell = self.reached[i] - self.width
                    missing -= self.arrive(cell - 1, step, &end) + self.arrive(cell + 1, step, &end)
                    cell = self.reached[i] + self.width
                    missing -= self.arrive(cell - 1, step, &end) + self.arrive(cell + 1, step, &end)
            if end == stop:
                break
            older, old = old, stop
        return end > 0

    cdef inline int64_t arrive(self, int64_t cell, uint8_t step, int64_t* end) noexcept:
        """Note that a cell is reached now, if it is free and was not; return how many that were awaited are."""
        if not self.free[cell] or self.left[cell] != NOWHERE:
            return 0
        self.left[cell] = step
        self.reached[end[0]] = cell
        end[0] += 1
        return self.awaited[cell]

    cdef void look_ahead(self, Walker* w) noexcept:
        """Write the point some steps ahead, whether there is a way, and whether it ends there."""
        cdef int64_t cell = self.cell(w.at), x = cell % self.width, y = cell // self.width, best_x, best_y, dx, dy
        cdef double goal_x = (w.goal.x - self.low.x) * FINE - 0.5, goal_y = (w.goal.y - self.low.y) * FINE - 0.5
        cdef double beside_x, beside_y, cost, best
        cdef int64_t hop
        for hop in range(HOPS + 1):
            best, best_x, best_y = INFINITY, x, y
            for dy in range(-AROUND, AROUND + 1):
                beside_y = (y - goal_y) + dy
                for dx in range(-AROUND, AROUND + 1):
                    beside_x = (x - goal_x) + dx
                    cost = beside_y * beside_y + beside_x * beside_x
                    cost = self.left[(y + dy) * self.width + x + dx] + NEARER * cost
                    if cost < best:
                        best, best_x, best_y = cost, x + dx, y + dy
            x, y = best_x, best_y
            if hop == 0:
                w.found = self.left[y * self.width + x] < NOWHERE
        w.arrives = self.left[y * self.width + x] == 0
        w.ahead.x, w.ahead.y = (x + 0.5) / FINE + self.low.x, (y + 0.5) / FINE + self.low.y


cdef Py_ssize_t settle(Walker* walkers, Py_ssize_t k, double width) noexcept:
    """Write who arrives where none who is nearer to its place does; return how many do."""
    cdef Py_ssize_t i, j, settled = 0
    cdef double x, y
    for i in range(k):
        walkers[i].settled = walkers[i].arrives
        for j in range(k):
            if not (walkers[i].settled and walkers[j].arrives and walkers[j].left < walkers[i].left):
                continue
            x, y = walkers[i].ahead.x - walkers[j].ahead.x, walkers[i].ahead.y - walkers[j].ahead.y
            if x * x + y * y < width * width:
                walkers[i].settled = False
        settled += walkers[i].settled
    return settled
