cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef double HARVEST_GAP
cdef double LEAST

cpdef double distance_in(WorldFields world, int64_t slot, int64_t place) except -1.0
cdef double distance(Columns c, double* table, int64_t slot, int64_t place) noexcept
