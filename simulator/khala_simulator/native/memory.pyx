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


cdef enum:
    BLOCK = 128


cdef double pairwise_sum(double* numbers, Py_ssize_t n) noexcept nogil:
    cdef double[8] part
    cdef double total = 0.0
    cdef Py_ssize_t i, k, half
    if n < 8:
        for i in range(n):
            total += numbers[i]
        return total
    if n > BLOCK:
        half = n // 2
        half -= half % 8
        return pairwise_sum(numbers, half) + pairwise_sum(numbers + half, n - half)
    for k in range(8):
        part[k] = numbers[k]
    for i in range(8, n - n % 8, 8):
        for k in range(8):
            part[k] += numbers[i + k]
    total = ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]))
    for i in range(n - n % 8, n):
        total += numbers[i]
    return total
