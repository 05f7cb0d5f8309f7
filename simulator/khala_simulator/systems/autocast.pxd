cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t SCAN_PERIOD

@cython.locals(loop=int64_t, closed=dict, slot=int64_t, is_free=bint)
cpdef look_out(WorldFields world)
cdef bint _use_first_wanted(WorldFields world, int64_t slot, int64_t owner, dict closed) except -1
