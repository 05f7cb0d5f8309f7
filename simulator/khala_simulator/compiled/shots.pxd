"""The rows of the tables in `world.shots`."""
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Point, boolean

cdef packed struct Shot:
    int64_t source
    int64_t owner
    int64_t target
    int64_t prior
    int64_t weapon
    int64_t hit
    Point start
    Point goal

cdef packed struct Missile:
    Shot shot
    Point pos
    double step
    double top
    double gain

cdef packed struct PendingHit:
    Shot shot
    double due
    boolean single

cdef object as_tuple(Shot* shot)
cdef Shot from_tuple(object shot)
cdef object emptied(object table, Py_ssize_t rows)
cdef append(object table, void* rows, Py_ssize_t more)
