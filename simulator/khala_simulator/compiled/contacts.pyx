"""Contacts, compiled: which bodies touch or nearly do; `movement.contacts` has the rules.

The order of the pairs is that of the rules, as forces are summed up in it.
"""
from libc.stdint cimport int64_t
from libc.stdlib cimport free, realloc

from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.compiled.numbers cimport most

from khala_simulator.movement import contacts as rules

cdef double SKIN = rules.SKIN
cdef double OVERLAP_ALLOWED = rules.OVERLAP_ALLOWED
cdef Py_ssize_t TABLE_LIMIT = rules.TABLE_LIMIT


cdef class Crowd:
    def __dealloc__(self):
        free(self.before)
        free(self.after)
        free(self.start)
        free(self.force)
        free(self.enemy)
        free(self.friend)
        free(self.places)
        free(self.ranked)
        free(self.sorted)
        free(self.index)
        free(self.pairs)
        free(self.chosen)
        free(self.close)

    def __reduce__(self):
        """Return what makes None: a copy of a world makes its own room."""
        return type(None), ()

    cdef int reserve(self, Py_ssize_t count, Py_ssize_t slots) except -1:
        """Make room for so many bodies in so many slots."""
        cdef Py_ssize_t i
        self.count = count
        if count > self.room:
            self.room = 2 * count
            self.before = <Point*>grown(self.before, self.room * sizeof(Point))
            self.after = <Point*>grown(self.after, self.room * sizeof(Point))
            self.start = <Point*>grown(self.start, self.room * sizeof(Point))
            self.force = <Point*>grown(self.force, self.room * sizeof(Point))
            self.enemy = <double*>grown(self.enemy, self.room * sizeof(double))
            self.friend = <double*>grown(self.friend, self.room * sizeof(double))
            self.places = <Place*>grown(self.places, self.room * sizeof(Place))
            self.ranked = <Place*>grown(self.ranked, self.room * sizeof(Place))
            self.close = <Py_ssize_t*>grown(self.close, self.room * sizeof(Py_ssize_t))
            self.sorted = <int64_t*>grown(self.sorted, self.room * sizeof(int64_t))
        if slots > self.slots:
            self.index = <int64_t*>grown(self.index, slots * sizeof(int64_t))
            for i in range(self.slots, slots):
                self.index[i] = -1
            self.slots = slots
        return 0

    cdef int near(self, Columns c, int64_t* slots) except -1:
        """Find the pairs that touch or nearly do; return whether any two touch."""
        cdef Py_ssize_t bodies = 0, i
        cdef int64_t slot
        cdef Place* place
        for i in range(self.count):
            slot = slots[i]
            if c.layer_bits[slot] != 0 and not c.walled[slot]:
                place = &self.places[bodies]
                bodies += 1
                place.along, place.across = self.after[i].x, self.after[i].y
                place.separation, place.bits, place.body = c.separation[slot], c.layer_bits[slot], i
        self.many = 0
        self.closest = 1e300
        self.by_slots = self.count <= TABLE_LIMIT
        if not bodies:
            return False
        return self.all_pairs(bodies) if self.by_slots else self.neighbours(slots, bodies)

    cdef int all_pairs(self, Py_ssize_t bodies) except -1:
        """Measure every pair, by slots; return whether any two touch."""
        cdef Place* places = self.places
        cdef Py_ssize_t i, j, close
        cdef int touch = False
        cdef double x, y, beside
        for i in range(bodies):
            close = 0
            for j in range(i + 1, bodies):  # without a branch, as none could be foreseen
                x, y = places[i].along - places[j].along, places[i].across - places[j].across
                beside = places[i].separation + places[j].separation + SKIN
                self.close[close] = j
                close += x * x + y * y < beside * beside
            for j in range(close):
                touch |= self.note(&places[i], &places[self.close[j]])
        return touch

    cdef int neighbours(self, int64_t* slots, Py_ssize_t bodies) except -1:
        """Measure those that follow each other along the wider axis of the crowd; return whether any two touch."""
        cdef Place* places = self.ranked
        cdef Py_ssize_t i, j, close, end = 0
        cdef int touch = False
        cdef double widest = 0.0, reach, x, y, beside
        for i in range(bodies):
            widest = most(widest, self.places[i].separation)
        reach = 2.0 * widest + SKIN
        self.rank(slots, bodies)
        for i in range(bodies):
            while end < bodies and places[end].along < places[i].along + reach:
                end += 1
            close = 0
            for j in range(i + 1, end):
                x, y = places[i].along - places[j].along, places[i].across - places[j].across
                beside = places[i].separation + places[j].separation + SKIN
                self.close[close] = j
                close += x * x + y * y < beside * beside
            for j in range(close):
                touch |= self.note(&places[i], &places[self.close[j]])
        return touch

    cdef int note(self, Place* one, Place* other) except -1:
        """Note a pair that is near, if they can meet; return whether it touches."""
        cdef double apart = one.separation + other.separation, inside = most(apart - OVERLAP_ALLOWED, 0.0)
        cdef double x = one.along - other.along, y = one.across - other.across, squared = x * x + y * y
        cdef Pair* pair
        if one.bits & other.bits == 0:
            return False
        if self.many == self.pair_room:
            self.pair_room = 2 * self.pair_room + 64
            self.pairs = <Pair*>grown(self.pairs, self.pair_room * sizeof(Pair))
            self.chosen = <Py_ssize_t*>grown(self.chosen, self.pair_room * sizeof(Py_ssize_t))
        pair = &self.pairs[self.many]
        self.many += 1
        pair.one, pair.other, pair.apart = one.body, other.body, apart
        if squared < self.closest:
            self.closest = squared
        return squared < inside * inside

    cdef void rank(self, int64_t* slots, Py_ssize_t bodies) noexcept:
        """Sort the places along the wider axis, from their last order, which is nearly right; equal ones by slot."""
        cdef Place* places = self.places
        cdef Place* ranked = self.ranked
        cdef Place place
        cdef Py_ssize_t i, j, known = 0
        cdef double low_x = places[0].along, high_x = low_x, low_y = places[0].across, high_y = low_y
        for i in range(bodies):
            low_x, high_x = min(low_x, places[i].along), max(high_x, places[i].along)
            low_y, high_y = min(low_y, places[i].across), max(high_y, places[i].across)
            self.index[slots[places[i].body]] = i
        if high_x - low_x < high_y - low_y:
            for i in range(bodies):
                places[i].along, places[i].across = places[i].across, places[i].along
        for i in range(self.known):
            j = self.index[self.sorted[i]]
            if j >= 0:
                ranked[known] = places[j]
                known += 1
                self.index[self.sorted[i]] = -1
        for i in range(bodies):
            if self.index[slots[places[i].body]] >= 0:
                ranked[known] = places[i]
                known += 1
                self.index[slots[places[i].body]] = -1
        for i in range(1, bodies):
            place = ranked[i]
            j = i
            while j > 0 and (
                ranked[j - 1].along > place.along
                or ranked[j - 1].along == place.along and ranked[j - 1].body > place.body
            ):
                ranked[j] = ranked[j - 1]
                j -= 1
            ranked[j] = place
        for i in range(bodies):
            self.sorted[i] = slots[ranked[i].body]
        self.known = bodies


cdef void* grown(void* memory, size_t size) except NULL:
    """Return larger memory with the same content."""
    memory = realloc(memory, size)
    if memory == NULL:
        raise MemoryError("no room for the bodies of a world")
    return memory


cdef Crowd crowd_of(object world):
    """Return the crowd of a world."""
    known = world.bodies
    if not isinstance(known, Crowd):
        known = world.bodies = Crowd.__new__(Crowd)
    return <Crowd>known
