"""Flow, compiled: the ways of a crowd round the bodies that stand; `movement.flow` has the rules."""
from libc.math cimport INFINITY, ceil, floor
from libc.stdint cimport int64_t, uint8_t, uint64_t
from libc.stdlib cimport calloc, free, malloc
from libc.string cimport memcpy, memset

from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.compiled.numbers cimport least, length, most
from khala_simulator.compiled.surfaces cimport Grid

from khala_simulator.movement import flow as rules

cdef enum:
    WORD = 8  # cells in a word
cdef int64_t FINE = rules.FINE
cdef double MARGIN = rules.MARGIN
cdef uint8_t NOWHERE = rules.NOWHERE
cdef uint64_t TAKEN = int.from_bytes(bytes([NOWHERE + 1] * WORD))  # cells that are not free
cdef int64_t HOPS = rules.HOPS
cdef double NEARER = rules.NEARER
cdef int64_t AROUND = rules.SIDE.max()

cdef class Flow:
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

    cdef void stand(self, Point at, double apart) noexcept:
        """Take the cells nearer than ``apart`` to a body."""
        self.paint(self.free, at, apart, False)

    cdef void reach(self, Point at, double within) noexcept:
        """Mark the cells within a distance of a target as places to go to."""
        self.paint(self.wanted, at, within, True)

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

    cdef void find(self, Walker* walkers, Py_ssize_t k, double width) noexcept:
        """Write the points ``ahead`` that walkers head for, and which of them have a way.

        Of ways that are equally short each takes the one that leads nearer to its goal. Where a walker is about to
        arrive others of its ``width`` find no room, and go on to the next place.
        """
        cdef Py_ssize_t i, settled
        cdef Walker* w
        cdef Walker further
        for i in range(k):
            walkers[i].found = walkers[i].settled = False
        if not self.spread(walkers, k):
            return
        for i in range(k):
            w = &walkers[i]
            self.look_ahead(w)
            w.left = length(w.ahead.x - w.at.x, w.ahead.y - w.at.y)
        settled = settle(walkers, k, width)
        if not 0 < settled < k:
            return
        for i in range(k):
            if walkers[i].settled:
                self.stand(walkers[i].ahead, width)
        self.spread(walkers, k)
        for i in range(k):
            further = walkers[i]
            if not further.settled:
                self.look_ahead(&further)
                if further.found:
                    walkers[i].ahead = further.ahead

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
        memset(self.awaited, False, self.size)
        for word in range(self.words):
            (<uint64_t*>self.left)[word] = TAKEN - (<uint64_t*>self.free)[word]
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

    cdef int64_t arrive(self, int64_t cell, uint8_t step, int64_t* end) noexcept:
        """Note that a cell is reached now, if it is free and was not before; return how many awaited ones that are."""
        if self.left[cell] != NOWHERE:
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
                    cost = min(self.left[(y + dy) * self.width + x + dx], NOWHERE) + NEARER * cost
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


cdef Flow flow_around(Grid grid, Walker* walkers, Py_ssize_t k):
    """Return a grid around walkers, with nothing on it yet."""
    cdef Flow flow = Flow.__new__(Flow)
    cdef Point low = walkers[0].at, high = walkers[0].at, at
    cdef Py_ssize_t i
    for i in range(k):
        at = walkers[i].at
        low.x, low.y = least(low.x, at.x), least(low.y, at.y)
        high.x, high.y = most(high.x, at.x), most(high.y, at.y)
    low.x, low.y = floor(low.x + (grid.shift - MARGIN)), floor(low.y + (grid.shift - MARGIN))
    high.x, high.y = ceil(high.x + (grid.shift + MARGIN)), ceil(high.y + (grid.shift + MARGIN))
    flow.low.x, flow.low.y = low.x - grid.shift, low.y - grid.shift
    flow.width, flow.height = <int64_t>(high.x - low.x) * FINE, <int64_t>(high.y - low.y) * FINE
    flow.size = flow.width * flow.height
    flow.words = (flow.size + WORD - 1) // WORD
    flow.free = <boolean*>calloc(flow.words, WORD)
    flow.wanted = <boolean*>calloc(flow.words, WORD)
    flow.awaited = <boolean*>malloc(flow.size)
    flow.left = <uint8_t*>malloc(flow.words * WORD)
    flow.reached = <int64_t*>malloc(flow.size * sizeof(int64_t))
    if not (flow.free and flow.wanted and flow.awaited and flow.left and flow.reached):
        raise MemoryError("no room for the ways of a crowd")
    flow.stand_on(grid, <int64_t>low.x, <int64_t>low.y)
    return flow
