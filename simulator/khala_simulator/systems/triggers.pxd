cimport cython
from libc.stdint cimport int64_t

from khala_simulator.world.fields cimport WorldFields


cpdef run(WorldFields world)
@cython.locals(period=int64_t)
cdef bint _is_time(WorldFields world) except -1
