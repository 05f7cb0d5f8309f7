cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns

cdef double HARVEST_GAP
cdef double LEAST

cpdef double distance_in(object world, int64_t slot, int64_t place) except -1.0
cdef double distance(Columns c, double* table, int64_t slot, int64_t place) noexcept
