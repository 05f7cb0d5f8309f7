cimport cython
from libc.stdint cimport int64_t


cdef class Shot:
    cdef public int64_t source
    cdef public int64_t owner
    cdef public int64_t target
    cdef public int64_t prior
    cdef public int64_t weapon
    cdef public int64_t hit
    cdef public double start_x
    cdef public double start_y
    cdef public double goal_x
    cdef public double goal_y
    @cython.locals(shot=Shot)
    cpdef Shot at(self, int64_t target)


cdef class Missile:
    cdef public Shot shot
    cdef public double x
    cdef public double y
    cdef public double step
    cdef public double top
    cdef public double gain


cdef class PendingHit:
    cdef public Shot shot
    cdef public double due
    cdef public bint single


cdef class Sweep:
    cdef public Shot shot
    cdef public double begun
    cdef public Py_ssize_t ahead
    cdef public list touched
