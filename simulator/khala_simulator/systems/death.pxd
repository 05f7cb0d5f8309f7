cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY


@cython.locals(dead=list)
cpdef bury(WorldFields world)
@cython.locals(i=Py_ssize_t)
cdef list _find_dead(WorldFields world)
@cython.locals(c=Columns, attacker=int64_t, owner=int64_t, killer=int64_t, victim=int64_t)
cdef _bury(WorldFields world, int64_t slot, dict killers)
