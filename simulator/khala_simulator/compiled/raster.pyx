"""Layers of discs, compiled; `api.raster` has the rules."""
cimport numpy as cnp
from libc.math cimport ceil, floor, sqrt
from libc.stdint cimport int32_t, uint8_t
from libc.stdlib cimport calloc, free
from libc.string cimport memset

from khala_simulator.compiled.numbers cimport count, floats, least, most

cnp.import_array()

cdef enum:
    LAYERS = 64


cdef double SLACK = 1e-6
"""Pixels beside the edge of a disc for which nothing is decided without the root, as it is rounded."""


cdef class DiscLayers:
    """Layers that show values of discs; it draws into the message itself and clears only what was drawn before."""

    cdef bytearray message  # all layers as fields, one after the other
    cdef Py_ssize_t columns, rows, shown, drawn
    cdef uint8_t* image[LAYERS]  # where the pixels of each layer begin
    cdef int bits[LAYERS]
    cdef Py_ssize_t value_of[LAYERS]  # row of the values
    cdef bint used[LAYERS]  # whether it has a pixel that is not 0
    cdef bint dense
    cdef uint8_t* density
    cdef uint8_t* smooth
    cdef int32_t* top  # [area] topmost disc of a pixel, from 1, or 0
    cdef int32_t* discs  # [area] how many cover it
    cdef double* covered  # [area] 16 x the area that they cover
    cdef int32_t* pixels  # [area] those that were drawn, in any order

    def __init__(self, list layers, tuple density, int columns, int rows):
        cdef Py_ssize_t area = columns * rows, k
        if len(layers) > LAYERS:
            raise ValueError(f"{len(layers)} layers; at most {LAYERS} are possible")
        self.columns, self.rows, self.shown, self.dense = columns, rows, len(layers), density is not None
        self.message = bytearray()
        starts = []
        for layer in (*(layer for _, layer in layers), *(density or ())):
            head, pixels = layer.blank
            self.message += head
            starts.append(len(self.message))
            self.message += pixels
        cdef uint8_t* data = <uint8_t*><char*>self.message
        for k, (value, layer) in enumerate(layers):
            self.image[k] = data + <Py_ssize_t>starts[k]
            self.bits[k], self.value_of[k], self.used[k] = layer.bits_per_pixel, value, False
        if self.dense:
            self.density = data + <Py_ssize_t>starts[self.shown]
            self.smooth = data + <Py_ssize_t>starts[self.shown + 1]
        self.top = <int32_t*>calloc(area, sizeof(int32_t))
        self.discs = <int32_t*>calloc(area, sizeof(int32_t))
        self.covered = <double*>calloc(area, sizeof(double))
        self.pixels = <int32_t*>calloc(area, sizeof(int32_t))
        if not (self.top and self.discs and self.covered and self.pixels):
            raise MemoryError

    def __dealloc__(self):
        free(self.top)
        free(self.discs)
        free(self.covered)
        free(self.pixels)

    def encode(self, x, y, radius, values):
        """Return the fields of all layers, as `api.raster.DiscLayers` does; they change with the next call."""
        cdef cnp.ndarray table = values
        if table.dtype != "int32" or not cnp.PyArray_ISCARRAY_RO(table):
            raise ValueError("the values of discs are a contiguous array of int32")
        cdef Py_ssize_t n = count(table[0]), k
        for column in (x, y, radius):
            if column.dtype != "float64" or not column.flags.c_contiguous or len(column) != n:
                raise ValueError("the centres and radii of discs are contiguous arrays of float64, one for each value")
        self.clear()
        self.draw(floats(x), floats(y), floats(radius), n)
        for k in range(self.shown):
            self.fill(k, <int32_t*>cnp.PyArray_DATA(table) + self.value_of[k] * n, n)
        if self.dense:
            self.fill_density()
        return [self.message]

    cdef void clear(self) noexcept:
        """Make every layer blank."""
        cdef Py_ssize_t k, i
        cdef int32_t pixel
        for k in range(self.shown):
            if self.used[k]:
                self.used[k] = False
                if self.bits[k] == 1:
                    for i in range(self.drawn):
                        self.image[k][self.pixels[i] >> 3] = 0
                elif self.bits[k] == 8:
                    for i in range(self.drawn):
                        self.image[k][self.pixels[i]] = 0
                else:
                    for i in range(self.drawn):
                        memset(self.image[k] + 4 * <Py_ssize_t>self.pixels[i], 0, 4)
        for i in range(self.drawn):
            pixel = self.pixels[i]
            self.top[pixel] = self.discs[pixel] = 0
            self.covered[pixel] = 0.0
            if self.dense:
                self.density[pixel] = self.smooth[pixel] = 0
        self.drawn = 0

    cdef void draw(self, double* x, double* y, double* radius, Py_ssize_t n) noexcept:
        """Find the pixels of all discs, the topmost disc of each, how many there are, and how much they cover."""
        cdef Py_ssize_t disc, column, row, left, right, low, high, middle_x, middle_y, pixel
        cdef double reach, distance, dx, dy, cover, squared, far, close
        cdef bint inside
        for disc in range(n):
            reach = ceil(radius[disc] + 0.5)
            if not (-reach <= x[disc] < self.columns + reach and -reach <= y[disc] < self.rows + reach):
                continue
            far = (radius[disc] + 0.5 + SLACK) * (radius[disc] + 0.5 + SLACK)
            close = most(radius[disc] - 0.5 - SLACK, 0.0) * most(radius[disc] - 0.5 - SLACK, 0.0)
            middle_x, middle_y = <Py_ssize_t>floor(x[disc]), <Py_ssize_t>floor(y[disc])
            left, right = max(middle_x - <Py_ssize_t>reach, 0), min(middle_x + <Py_ssize_t>reach + 1, self.columns)
            low, high = max(middle_y - <Py_ssize_t>reach, 0), min(middle_y + <Py_ssize_t>reach + 1, self.rows)
            for row in range(low, high):
                dy = row + 0.5 - y[disc]
                for column in range(left, right):
                    dx = column + 0.5 - x[disc]
                    squared = dx * dx + dy * dy
                    inside = column == middle_x and row == middle_y
                    if squared > far and not inside:
                        continue
                    if squared < close:
                        inside, cover = True, 1.0
                    else:  # at the edge, where a pixel is covered in part
                        distance = sqrt(squared)
                        cover = least(most(radius[disc] - distance + 0.5, 0.0), 1.0)
                        inside = inside or distance <= radius[disc]
                        if not (inside or cover > 0.0):
                            continue
                    pixel = row * self.columns + column
                    if self.top[pixel] == 0 and self.discs[pixel] == 0 and self.covered[pixel] == 0.0:
                        self.pixels[self.drawn] = <int32_t>pixel
                        self.drawn += 1
                    self.covered[pixel] += cover * 16
                    if inside:
                        self.top[pixel] = <int32_t>(disc + 1)
                        self.discs[pixel] += 1

    cdef void fill(self, Py_ssize_t k, int32_t* values, Py_ssize_t n) noexcept:
        """Write one layer: the value of the topmost disc at each pixel."""
        cdef Py_ssize_t i
        cdef int32_t pixel, value
        for i in range(n):
            if values[i]:
                break
        else:
            return
        self.used[k] = True
        for i in range(self.drawn):
            pixel = self.pixels[i]
            if self.top[pixel] == 0:
                continue
            value = values[self.top[pixel] - 1]
            if value == 0:
                continue
            if self.bits[k] == 1:
                self.image[k][pixel >> 3] |= <uint8_t>(0x80 >> (pixel & 7))
            elif self.bits[k] == 8:
                self.image[k][pixel] = <uint8_t>value
            else:
                self.image[k][4 * <Py_ssize_t>pixel] = <uint8_t>value
                self.image[k][4 * <Py_ssize_t>pixel + 1] = <uint8_t>(value >> 8)
                self.image[k][4 * <Py_ssize_t>pixel + 2] = <uint8_t>(value >> 16)
                self.image[k][4 * <Py_ssize_t>pixel + 3] = <uint8_t>(value >> 24)

    cdef void fill_density(self) noexcept:
        """Write how many discs are at each pixel, and how much of it they cover."""
        cdef Py_ssize_t i
        cdef int32_t pixel
        for i in range(self.drawn):
            pixel = self.pixels[i]
            self.density[pixel] = <uint8_t>min(self.discs[pixel], 255)
            self.smooth[pixel] = <uint8_t>least(self.covered[pixel], 255.0)
