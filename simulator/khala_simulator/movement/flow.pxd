cimport cython
from libc cimport math
from libc.stdint cimport int64_t, uint8_t

from khala_simulator.movement.grids cimport SurfaceGrid
from khala_simulator.native cimport memory
from khala_simulator.native.memory cimport Point

cdef int64_t FINE
cdef double MARGIN
cdef int64_t NOWHERE
cdef int64_t TAKEN
cdef int64_t HOPS
cdef int64_t AROUND
cdef double NEARER


@cython.final
cdef class Walker:
    cdef int64_t slot
    cdef Point at
    cdef Point goal
    cdef Point ahead
    cdef double left
    cdef bint found
    cdef bint arrives
    cdef bint settled


cdef Walker walker_of(int64_t slot, Point at, Point goal)


@cython.final
cdef class Flow:
    cdef Point low
    cdef int64_t width
    cdef int64_t height
    cdef tuple arrays
    cdef uint8_t* left
    cdef uint8_t* wanted
    cdef uint8_t* awaited
    cdef int64_t* goals
    cdef int64_t* reached
    cdef int64_t goal_count
    cdef int64_t end

    @cython.locals(first=Walker, walker=Walker, low=Point, high=Point, x0=int64_t, y0=int64_t, x1=int64_t,
                   y1=int64_t, size=int64_t)
    cdef cover(self, SurfaceGrid grid, list walkers)
    @cython.locals(x=int64_t, y=int64_t, row=int64_t, line=int64_t)
    cdef void lay_ground(self, SurfaceGrid grid, int64_t x0, int64_t y0) noexcept
    cdef void stand(self, Point at, double apart) noexcept
    cdef void reach(self, Point at, double within) noexcept
    @cython.locals(middle_x=double, middle_y=double, half=int64_t, column=int64_t, row=int64_t, i=int64_t, j=int64_t,
                   x=double, y=double, cell=int64_t)
    cdef void paint(self, Point at, double radius, bint wanted) noexcept
    @cython.locals(walker=Walker, settled=int64_t, before=bint)
    cdef find(self, list walkers, double width)
    @cython.locals(x=int64_t, y=int64_t)
    cdef int64_t cell(self, Point at) noexcept
    @cython.locals(walker=Walker, missing=int64_t, cell=int64_t, old=int64_t, older=int64_t, stop=int64_t, step=int64_t, i=int64_t)
    cdef bint spread(self, list walkers) except -1
    @cython.locals(walker=Walker, i=int64_t)
    cdef forget_count(self, list walkers)
    @cython.locals(changed=int64_t, middle=int64_t, x=int64_t, y=int64_t, cell=int64_t)
    cdef int64_t await_around(self, Walker walker, bint awaited) noexcept
    cdef int64_t arrive(self, int64_t cell, int64_t step) noexcept
    @cython.locals(cell=int64_t, x=int64_t, y=int64_t, best_x=int64_t, best_y=int64_t, dx=int64_t, dy=int64_t,
                   goal_x=double, goal_y=double, beside_x=double, beside_y=double, cost=double, best=double, hop=int64_t)
    cdef Point look_ahead(self, Walker walker) noexcept


cdef Flow flow_around(SurfaceGrid grid, list walkers)
@cython.locals(walker=Walker, rival=Walker, settled=int64_t)
cdef int64_t _settle(list walkers, double width) except -1
cdef bint _are_near(Walker walker, Walker rival, double width) noexcept
