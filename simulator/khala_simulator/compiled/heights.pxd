"""The height of the ground, as `Terrain.ground_z` has it."""
cimport cython
cimport numpy as cnp

@cython.final
cdef class Heights:
    """The heights at the corners of a map's cells."""

    cdef cnp.ndarray vertices
    cdef float* z
    cdef Py_ssize_t width
    cdef double right
    cdef double top

    cdef double at(self, double x, double y) noexcept
