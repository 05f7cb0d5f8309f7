cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NONE
cdef int64_t TO_RESOURCE
cdef int64_t TO_HALL

@cython.locals(loop=int64_t, harvests=bint, slot=int64_t)
cpdef run(WorldFields world)
cdef bint _is_due(Columns c, int64_t slot, int64_t loop) noexcept
