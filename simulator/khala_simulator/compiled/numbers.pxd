"""Arrays, and geometry of the plane, as `numeric` has them; what rounds does so in the same order."""
cimport numpy as cnp
from libc.math cimport sqrt
from libc.stdint cimport int64_t

cdef inline int64_t* ints(object array):
    """Return the numbers of an int64 array whose memory is contiguous."""
    return <int64_t*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline double* floats(object array):
    """Return the numbers of a float64 array whose memory is contiguous."""
    return <double*>cnp.PyArray_DATA(<cnp.ndarray>array)

cdef inline Py_ssize_t count(object array):
    """Return the length of an array's first axis."""
    return cnp.PyArray_DIM(<cnp.ndarray>array, 0)

cdef inline double length(double x, double y) noexcept nogil:
    """Return the length of a vector."""
    return sqrt(x * x + y * y)

cdef inline double most(double a, double b) noexcept nogil:
    """Return the larger number."""
    return a if a >= b else b

cdef inline double least(double a, double b) noexcept nogil:
    """Return the smaller number."""
    return a if a <= b else b

cdef inline cnp.ndarray new_ints(Py_ssize_t n):
    """Return a new int64 array (n,), not filled."""
    cdef cnp.npy_intp size = n
    return cnp.PyArray_EMPTY(1, &size, cnp.NPY_INT64, 0)

cdef inline cnp.ndarray new_floats(Py_ssize_t n):
    """Return a new float64 array (n,), not filled."""
    cdef cnp.npy_intp size = n
    return cnp.PyArray_EMPTY(1, &size, cnp.NPY_FLOAT64, 0)

cdef inline cnp.ndarray new_points(Py_ssize_t n):
    """Return a new float64 array (n, 2), not filled."""
    cdef cnp.npy_intp[2] size
    size[0], size[1] = n, 2
    return cnp.PyArray_EMPTY(2, size, cnp.NPY_FLOAT64, 0)
