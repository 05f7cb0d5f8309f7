cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns

cdef int64_t NOBODY
cdef int64_t BLOCKED_LOOPS
cdef double ROUNDING
cdef double CROWD_NEAR
cdef double CROWD_SHARE
cdef int64_t CROWD_PATIENCE
cdef int64_t CROWD_STALL


cdef class ArrivalCrowd:
    cdef object live
    cdef int64_t* slots
    cdef Py_ssize_t units
    cdef int64_t loop
    cdef double area


cpdef bint has_stalled(Columns c, int64_t slot, int64_t loop) noexcept
cdef bint is_packed(Columns c, ArrivalCrowd crowd, int64_t slot) except -1
@cython.locals(area=double, enough=double, i=Py_ssize_t, other=int64_t)
cdef bint _is_filled(Columns c, ArrivalCrowd crowd, int64_t slot, double squared) except -1
cdef bint _fills(Columns c, ArrivalCrowd crowd, int64_t slot, double squared, double area) except -1
cdef bint _is_inside(Columns c, int64_t slot, int64_t other, double squared) noexcept
@cython.locals(i=Py_ssize_t, other=int64_t, is_inside=bint)
cdef double _area(Columns c, ArrivalCrowd crowd, int64_t slot, double squared) except -1.0
