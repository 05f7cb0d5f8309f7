cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport census, targets
from khala_simulator.combat.census cimport Census
from khala_simulator.economy cimport touching
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef double EDGE_TOLERANCE
cdef double ON_TARGET
cdef double ARMS_LENGTH
cdef double BESIDE_WALLS
cdef double FOLLOW_GAP
cdef double HARVEST_OVERLAP
cdef double CHASE_SLACK
cdef double GUARD_SLACK_SQUARED
cdef int64_t FOLLOW
cdef int64_t TO_RESOURCE
cdef int64_t TO_HALL

@cython.locals(n=Py_ssize_t, slot=Py_ssize_t, fighting=Py_ssize_t, follows=bint, approaches=bint, goes_back=bint,
               rolls=bint, is_free=bint)
cpdef measure(WorldFields world)
@cython.locals(slot=Py_ssize_t, count=Py_ssize_t)
cdef void _note_fighters(Columns c, Py_ssize_t n, int64_t* fighters) noexcept
@cython.locals(beams=bint, rolling_guns=bint, guns_walking=bint, hides=bint, zones=bint, i=Py_ssize_t, slot=int64_t,
               target=int64_t, gap=double, reach=double, is_beyond=bint, is_near=bint)
cdef _close_in(WorldFields world, Columns c, Census kinds, int64_t* slots, Py_ssize_t fighting)
@cython.locals(gap=double)
cdef double _measure_gap(Columns c, int64_t slot, int64_t target) noexcept
cdef double _distance_to_walls(Columns c, int64_t slot, int64_t target) noexcept
@cython.locals(slot=Py_ssize_t, leader=int64_t, stop_at=double)
cdef void _follow(Columns c, Py_ssize_t n) noexcept
@cython.locals(slot=Py_ssize_t, place=int64_t, stop_at=double)
cdef _haul(WorldFields world, Columns c, Py_ssize_t n)
@cython.locals(slot=Py_ssize_t, target=int64_t, aimed=bint, waits=bint, follows=bint, stop_at=double)
cdef _approach(WorldFields world, Columns c, Py_ssize_t n)
@cython.locals(slot=Py_ssize_t, is_away=bint)
cdef void _go_back(Columns c, Py_ssize_t n) noexcept
