cimport cython
from libc.stdint cimport int64_t

from khala_simulator.movement cimport grids
from khala_simulator.movement.grids cimport SurfaceGrid, Lines
from khala_simulator.native cimport memory
from khala_simulator.native.memory cimport Point, boolean

cdef int64_t AHEAD
cdef int64_t[8] LOOK_AHEAD
cdef int64_t[8] STEP_X
cdef int64_t[8] STEP_Y
cdef double[8] COST


@cython.final
@cython.freelist(64)
cdef class Way:
    cdef int64_t walker
    cdef Point start
    cdef int64_t goal
    cdef int64_t[8] ahead
    cdef int64_t near
    cdef int64_t far
    cdef int64_t tried


cdef Way way_from(int64_t walker, Point start, int64_t goal)
@cython.locals(field=Field, way=Way, lines=Lines, i=Py_ssize_t)
cdef find_corners(SurfaceGrid grid, list ways)
cdef Point corner_of(SurfaceGrid grid, Way way)
@cython.locals(grid=SurfaceGrid, line=Lines, field=Field, here=int64_t, there=int64_t)
cpdef double distance(object surface, object start, object goal) except -1.0
cdef Field _field_to(SurfaceGrid grid, int64_t goal)


@cython.final
cdef class Field:
    cdef int64_t goal
    cdef tuple arrays
    cdef double* distance
    cdef int64_t* towards
    cdef boolean* settled
    cdef _Heap heap
    @cython.locals(cell=int64_t, at=int64_t, i=Py_ssize_t)
    cdef follow(self, SurfaceGrid grid, Way way)
    @cython.locals(cell=int64_t, i=Py_ssize_t)
    cdef reach(self, SurfaceGrid grid, int64_t wanted)


@cython.final
cdef class _Heap:
    cdef Py_ssize_t size
    cdef Py_ssize_t room
    cdef object distance_array
    cdef object cell_array
    cdef double* distances
    cdef int64_t* cells
    cdef grow(self)
    cdef push(self, double distance, int64_t cell)
    cdef int64_t pop(self) noexcept


cdef bint _comes_before(double distance, int64_t cell, double other_distance, int64_t other_cell) noexcept
