"""New arrays for compiled rules; see `memory.pxd`."""
cimport numpy as cnp

cnp.import_array()


cdef cnp.ndarray new_bools(Py_ssize_t n):
    cdef cnp.npy_intp size = n
    return cnp.PyArray_ZEROS(1, &size, cnp.NPY_BOOL, 0)


cdef cnp.ndarray new_ints(Py_ssize_t n):
    cdef cnp.npy_intp size = n
    return cnp.PyArray_EMPTY(1, &size, cnp.NPY_INT64, 0)


cdef cnp.ndarray new_floats(Py_ssize_t n):
    cdef cnp.npy_intp size = n
    return cnp.PyArray_EMPTY(1, &size, cnp.NPY_FLOAT64, 0)


cdef cnp.ndarray new_uint8s(Py_ssize_t n):
    cdef cnp.npy_intp size = n
    return cnp.PyArray_ZEROS(1, &size, cnp.NPY_UINT8, 0)


cdef cnp.ndarray new_int32s(Py_ssize_t n):
    cdef cnp.npy_intp size = n
    return cnp.PyArray_ZEROS(1, &size, cnp.NPY_INT32, 0)


cdef cnp.ndarray new_points(Py_ssize_t n):
    cdef cnp.npy_intp[2] size
    size[0] = n
    size[1] = 2
    return cnp.PyArray_EMPTY(2, size, cnp.NPY_FLOAT64, 0)
