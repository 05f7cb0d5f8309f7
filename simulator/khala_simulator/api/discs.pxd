cimport cython
from libc cimport math
from libc.stdint cimport int32_t, int64_t, uint8_t

from khala_simulator.native cimport memory
from khala_simulator.native.memory cimport boolean

cdef double SLACK


@cython.final
cdef class DiscLayers:
    cdef tuple _arrays
    cdef Py_ssize_t _columns
    cdef Py_ssize_t _rows
    cdef Py_ssize_t _shown
    cdef bint _dense
    cdef uint8_t* _message
    cdef int64_t* _image
    cdef int64_t* _bits
    cdef int64_t* _value_of
    cdef boolean* _used
    cdef int32_t* _top
    cdef int32_t* _discs
    cdef double* _covered
    cdef int32_t* _pixels
    cdef Py_ssize_t _drawn
    @cython.locals(n=Py_ssize_t, disc=Py_ssize_t, k=Py_ssize_t)
    cpdef encode(self, object x, object y, object radius, object values)
    @cython.locals(k=Py_ssize_t, i=Py_ssize_t, pixel=int32_t)
    cdef void _clear(self) noexcept
    @cython.locals(image=int64_t, bits=int64_t, i=Py_ssize_t, pixel=int32_t, at=int64_t)
    cdef void _blank(self, Py_ssize_t k) noexcept
    @cython.locals(reach=double, far=double, close=double, around=Py_ssize_t, middle_column=Py_ssize_t,
                   middle_row=Py_ssize_t, row=Py_ssize_t, column=Py_ssize_t, dx=double, dy=double, squared=double,
                   inside=bint, cover=double, distance=double)
    cdef void _draw(self, Py_ssize_t disc, double x, double y, double radius) noexcept
    cdef void _touch(self, Py_ssize_t pixel, Py_ssize_t disc, bint inside, double cover) noexcept
    @cython.locals(image=int64_t, bits=int64_t, i=Py_ssize_t, pixel=int32_t, disc=int32_t, value=int32_t, at=int64_t)
    cdef void _fill(self, Py_ssize_t k, int32_t* values, Py_ssize_t first, Py_ssize_t n) noexcept
    @cython.locals(i=Py_ssize_t, pixel=int32_t, smooth=int64_t)
    cdef void _fill_density(self) noexcept
