"""Flow, compiled: the ways of a crowd round the bodies that stand; `movement.flow` has the rules."""
cimport cython
from libc.stdint cimport int64_t, uint8_t

from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.compiled.surfaces cimport Grid

cdef struct Walker:
    int64_t slot
    Point at
    Point goal
    Point ahead  # the point that it heads for
    double left  # how far that is
    bint found  # whether there is a way
    bint arrives  # and ends there
    bint settled  # whether others go round that place

@cython.final
cdef class Flow:
    """A grid around walkers; ``stand`` and ``reach`` say what is on it, ``points`` finds the ways."""

    cdef Point low
    cdef int64_t width
    cdef int64_t height
    cdef int64_t size  # of the grid, in cells
    cdef int64_t words
    cdef boolean* free
    cdef boolean* wanted
    cdef boolean* awaited  # the cells around walkers
    cdef uint8_t* left  # steps from each cell to a place to go to, more than ``NOWHERE`` if it is not free
    cdef int64_t* reached  # cells in the order of these

    cdef void stand_on(self, Grid grid, int64_t low_x, int64_t low_y) noexcept
    cdef void stand(self, Point at, double apart) noexcept
    cdef void reach(self, Point at, double within) noexcept
    cdef void find(self, Walker* walkers, Py_ssize_t k, double width) noexcept
    cdef void paint(self, boolean* grid, Point at, double radius, boolean value) noexcept
    cdef int64_t cell(self, Point at) noexcept
    cdef bint spread(self, Walker* walkers, Py_ssize_t k) noexcept
    cdef int64_t arrive(self, int64_t cell, uint8_t step, int64_t* end) noexcept
    cdef void look_ahead(self, Walker* w) noexcept

cdef Flow flow_around(Grid grid, Walker* walkers, Py_ssize_t k)
