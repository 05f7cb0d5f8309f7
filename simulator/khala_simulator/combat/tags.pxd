cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns

cdef int64_t NOBODY
cdef int64_t INDEX_SHIFT
cdef int64_t SLOT_BITS


@cython.locals(slot=int64_t)
cdef int64_t slot_of(Columns c, int64_t tag) noexcept
