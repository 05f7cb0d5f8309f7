cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY


@cython.locals(slot=int64_t)
cpdef bury(WorldFields world)
@cython.locals(i=Py_ssize_t, dead=Py_ssize_t)
cdef Py_ssize_t _count_dead(WorldFields world) except -1
@cython.locals(other=int64_t)
cdef bint _carries(WorldFields world, int64_t slot) except -1
@cython.locals(c=Columns, attacker=int64_t, owner=int64_t, killer=int64_t, victim=int64_t)
cdef _bury(WorldFields world, int64_t slot, dict killers)
