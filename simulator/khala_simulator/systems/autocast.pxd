cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t SCAN_PERIOD

@cython.locals(loop=int64_t, slot=int64_t, lacking=dict)
cpdef look_out(WorldFields world)
cdef _use_first_wanted(WorldFields world, int64_t slot, int64_t owner, dict lacking)
