cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t SCAN_PERIOD

@cython.locals(slot=int64_t, abilities=tuple)
cpdef look_out(WorldFields world)
cdef list _find_casters(WorldFields world)
cdef _use_first_wanted(WorldFields world, int64_t slot, tuple abilities)
