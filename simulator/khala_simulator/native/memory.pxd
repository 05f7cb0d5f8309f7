"""Numbers in arrays, and points, for compiled rules; `memory.py` has the same for interpreted ones, and says what."""
cimport numpy as cnp
from libc.math cimport hypot, sqrt
from libc.stdint cimport int16_t, int32_t, int64_t, uint8_t, uint16_t
from libc.string cimport memcpy, memset

ctypedef uint8_t boolean

cdef struct Point:
    double x
    double y

cdef inline Point point(double x, double y) noexcept nogil:
    cdef Point new
    new.x = x
    new.y = y
    return new

cdef inline boolean* bools(object array):
    return <boolean*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline int64_t* ints(object array):
    return <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline double* floats(object array):
    return <double*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline uint8_t* uint8s(object array):
    return <uint8_t*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline uint16_t* uint16s(object array):
    return <uint16_t*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline int16_t* int16s(object array):
    return <int16_t*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline int32_t* int32s(object array):
    return <int32_t*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline float* float32s(object array):
    return <float*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline Point* points(object array):
    return <Point*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef cnp.ndarray new_bools(Py_ssize_t n)
cdef cnp.ndarray new_ints(Py_ssize_t n)
cdef cnp.ndarray new_floats(Py_ssize_t n)
cdef cnp.ndarray new_uint8s(Py_ssize_t n)
cdef cnp.ndarray new_int32s(Py_ssize_t n)
cdef cnp.ndarray new_points(Py_ssize_t n)

cdef inline double length(double x, double y) noexcept nogil:
    return sqrt(x * x + y * y)

cdef inline double distance(double x, double y) noexcept nogil:
    return hypot(x, y)

cdef inline double single(double number) noexcept nogil:
    return <float>number

cdef double pairwise_sum(double* numbers, Py_ssize_t n) noexcept nogil

cdef inline void put_float32(uint8_t* to, Py_ssize_t at, double number) noexcept nogil:
    cdef float single = <float>number
    memcpy(to + at, &single, sizeof(float))

cdef inline void fill(uint8_t* cells, Py_ssize_t start, Py_ssize_t n, uint8_t value) noexcept nogil:
    memset(cells + start, value, n)

cdef inline void repeat(uint8_t* cells, Py_ssize_t start, Py_ssize_t n, Py_ssize_t at) noexcept nogil:
    memcpy(cells + at, cells + start, n)

cdef inline void put_bytes(uint8_t* to, Py_ssize_t at, uint8_t* cells, Py_ssize_t n) noexcept nogil:
    memcpy(to + at, cells, n)
