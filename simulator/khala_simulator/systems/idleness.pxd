from libc.stdint cimport int64_t

from khala_simulator.world.fields cimport WorldFields

cdef int64_t LOOPS_PER_NORMAL_SECOND

cpdef count(WorldFields world)
