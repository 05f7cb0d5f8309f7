cimport cython
from libc.stdint cimport int64_t

from khala_simulator.movement cimport arrival
from khala_simulator.movement.arrival cimport ArrivalCrowd
from khala_simulator.native cimport columns
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t CROWD_PERIOD
cdef int64_t CROWD_STALL
cdef int64_t SCAN_PERIOD
cdef double ARRIVAL_RADIUS_SQUARED
cdef int64_t ATTACK_MOVE
cdef int64_t IDLE

@cython.locals(slot=int64_t, fought=bint)
cpdef carry_out(WorldFields world)
@cython.locals(slot=Py_ssize_t)
cdef list _find_lost(WorldFields world, Columns c)
@cython.locals(target=int64_t)
cdef bint _is_lost(Columns c, int64_t slot) noexcept
@cython.locals(loop=int64_t, just_looked=bint, looks_at_crowds=bint, crowd=ArrivalCrowd, slot=Py_ssize_t)
cdef _find_arrived(WorldFields world, Columns c, list found)
cdef bint _goes_on(Columns c, int64_t slot, bint just_looked) noexcept
cdef bint _is_there(Columns c, int64_t slot) noexcept
