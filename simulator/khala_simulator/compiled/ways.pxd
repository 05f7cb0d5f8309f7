"""Lines and shortest ways over a surface, compiled; `movement.pathfinding` has the rules."""
from khala_simulator.native.memory cimport Point
from khala_simulator.compiled.surfaces cimport Grid
from libc.stdint cimport int64_t

cdef struct Line:
    Point start
    Point end
    bint free  # whether a body of ordinary width gets from one to the other

cdef struct Way:
    Point start
    int64_t goal  # a cell in the connected part of the start
    int64_t[8] ahead  # cells on the way
    int64_t near  # the farthest of them that is known to be reached straight
    int64_t far  # and the farthest that may be

cdef int clear(Grid grid, Line* lines, Py_ssize_t n) except -1
cdef int find_corners(Grid grid, Way* ways, Py_ssize_t n) except -1
