cimport cython
from libc cimport math
from libc.stdint cimport int64_t

from khala_simulator.native cimport memory
from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.world.ground cimport BuiltGround

cdef double SIDE_CLEARANCE
cdef double SAMPLE_STEP


@cython.final
cdef class SurfaceGrid:
    cdef readonly object surface
    cdef Py_ssize_t fields_kept
    cdef dict fields
    cdef int64_t width
    cdef int64_t height
    cdef double shift
    cdef boolean* flat
    cdef boolean* open
    cdef int64_t* part
    cdef int64_t* sums
    cdef boolean* steps
    cdef Point* walls_low
    cdef Point* walls_high
    cdef boolean* spiked
    cdef (boolean*)[4] spikes
    cdef object spike_corners
    cdef Point* corners


@cython.final
cdef class Lines:
    cdef Py_ssize_t count
    cdef tuple arrays
    cdef Point* ends
    cdef boolean* free
    cdef void add(self, Point start, Point end) noexcept


cpdef SurfaceGrid read(object surface)
@cython.locals(grid=SurfaceGrid)
cdef SurfaceGrid grid_of(BuiltGround ground, int64_t layer)
@cython.locals(column=int64_t, row=int64_t)
cdef int64_t cell_at(SurfaceGrid grid, double x, double y) noexcept
cdef Point centre_of(SurfaceGrid grid, int64_t cell) noexcept
@cython.locals(i=Py_ssize_t, start=Point, end=Point, longest=double, samples=int64_t)
cdef void clear(SurfaceGrid grid, Lines lines) noexcept
@cython.locals(left=int64_t, low=int64_t, right=int64_t, high=int64_t)
cdef bint _box_is_free(SurfaceGrid grid, Point start, Point end) noexcept
cdef int64_t _floor(double x) noexcept
@cython.locals(i=int64_t, share=double)
cdef bint _sides_are_free(SurfaceGrid grid, Point start, Point end, int64_t samples) noexcept
