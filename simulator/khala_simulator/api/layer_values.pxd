cimport cython
from libc.stdint cimport int32_t, int64_t

from khala_simulator.native cimport memory

cdef int64_t OWNER
cdef int64_t ALLIANCE
cdef int64_t TYPE
cdef int64_t SELECTED
cdef int64_t LIFE
cdef int64_t LIFE_RATIO
cdef int64_t SHIELDS
cdef int64_t SHIELDS_RATIO
cdef int64_t ENERGY
cdef int64_t ENERGY_RATIO
cdef int64_t HALLUCINATION
cdef int64_t CLOAKED
cdef int64_t ACTIVE
cdef int64_t PROGRESS
cdef int64_t IS_PLACEHOLDER
cdef int64_t UNKNOWN
cdef int64_t NOT_CLOAKED
cdef int64_t PLACEHOLDER

@cython.locals(n=Py_ssize_t, i=Py_ssize_t, built=int64_t)
cpdef write_values(object sight, object selected, object values)
@cython.locals(i=Py_ssize_t, whole=int64_t, part=int64_t)
cdef void _write_points(int32_t* to, double* points, double* most, Py_ssize_t row, Py_ssize_t ratios,
                        Py_ssize_t n) noexcept
