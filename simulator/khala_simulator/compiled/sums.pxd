"""Sums in numpy's order."""

cdef enum:
    BLOCK = 128

cdef inline double pairwise(double* numbers, Py_ssize_t n) noexcept nogil:
    """Return the sum of numbers that lie one after the other, as `numpy.add.reduce` rounds it."""
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
        return pairwise(numbers, half) + pairwise(numbers + half, n - half)
    for k in range(8):
        part[k] = numbers[k]
    i = 8
    while i < n - n % 8:
        for k in range(8):
            part[k] += numbers[i + k]
        i += 8
    total = ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]))
    while i < n:
        total += numbers[i]
        i += 1
    return total
