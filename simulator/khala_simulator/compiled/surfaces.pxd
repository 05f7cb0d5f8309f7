"""The surfaces of `movement.pathfinding` as compiled systems read them."""
cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native.memory cimport Point, boolean

@cython.final
cdef class Grid:
    """One surface's cells, which never change."""

    cdef object surface
    cdef dict fields  # goal -> the ways to it
    cdef Py_ssize_t fields_kept  # so many
    cdef tuple arrays  # keeps the memory alive
    cdef int64_t width
    cdef int64_t height
    cdef double shift
    cdef boolean* flat  # (cells,) whether each is free
    cdef boolean* open  # and all around it
    cdef Point* walls_low
    cdef Point* walls_high
    cdef boolean* spiked
    cdef (boolean*)[4] spikes
    cdef Point[4] corners
    cdef int64_t* sums  # (height + 1, width + 1)
    cdef int64_t* part
    cdef boolean* steps  # (cells,) bit i says that a step to the i-th neighbour is free

cdef Grid read(object surface)
cdef Grid bound(object ground, int64_t layer)

cdef inline Grid grid_of(object ground, int64_t layer):
    """Return the surface of a layer now."""
    native = (<list>ground.native)[layer]
    return bound(ground, layer) if native is None else <Grid>native

cdef inline Point centre_of(Grid grid, int64_t cell) noexcept:
    """Return the centre of a cell."""
    cdef Point centre
    cdef int64_t row = cell // grid.width
    centre.x, centre.y = cell - row * grid.width + (0.5 - grid.shift), row + (0.5 - grid.shift)
    return centre

cdef inline int64_t cell_at(Grid grid, double x, double y) noexcept:
    """Return the cell under a point; a point outside counts as the nearest cell inside."""
    cdef int64_t column = <int64_t>(x + grid.shift), row = <int64_t>(y + grid.shift)
    column = 0 if column < 0 else grid.width - 1 if column >= grid.width else column
    row = 0 if row < 0 else grid.height - 1 if row >= grid.height else row
    return row * grid.width + column
