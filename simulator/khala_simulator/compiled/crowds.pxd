"""When a walker whose way is blocked by others is near enough to its goal, as `movement.arrival` has it."""
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns

cdef struct Crowd:
    int64_t* live  # slots
    Py_ssize_t units
    int64_t loop
    double area  # that all bodies would fill; negative before it was measured

cdef bint packed(Columns c, Crowd* crowd, int64_t slot) except -1
