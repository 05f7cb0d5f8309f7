"""Numbers in arrays, and points, for compiled rules; `memory.py` has the same for interpreted ones, and says what."""
cimport numpy as cnp
from libc.math cimport sqrt
from libc.stdint cimport int64_t, uint8_t

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

cdef inline Point* points(object array):
    return <Point*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef cnp.ndarray new_bools(Py_ssize_t n)
cdef cnp.ndarray new_ints(Py_ssize_t n)
cdef cnp.ndarray new_floats(Py_ssize_t n)
cdef cnp.ndarray new_points(Py_ssize_t n)

cdef inline double length(double x, double y) noexcept nogil:
    return sqrt(x * x + y * y)
