"""The height of the ground, compiled; `maps.game_map` has the rule."""
cimport cython
cimport numpy as cnp

from khala_simulator.compiled.numbers cimport least, most

cnp.import_array()


@cython.final
cdef class Heights:
    def __init__(self, terrain):
        if terrain.vertices.dtype != "float32" or not terrain.vertices.flags.c_contiguous:
            raise ValueError("the heights of a map are a contiguous array of float32")
        self.vertices = terrain.vertices
        self.z = <float*>cnp.PyArray_DATA(self.vertices)
        self.width = cnp.PyArray_DIM(self.vertices, 1)
        self.right, self.top = terrain.size[0] - 1e-6, terrain.size[1] - 1e-6

    cdef double at(self, double x, double y) noexcept:
        """Return the height under a world point, between those at the corners of its cell."""
        x, y = least(most(x, 0.0), self.right), least(most(y, 0.0), self.top)
        cdef Py_ssize_t column = <Py_ssize_t>x, row = <Py_ssize_t>y
        cdef double across = x - column, up = y - row
        cdef float* corner = self.z + row * self.width + column
        cdef double low = corner[0] * (1.0 - across) + corner[1] * across
        cdef double high = corner[self.width] * (1.0 - across) + corner[self.width + 1] * across
        return low * (1.0 - up) + high * up
