cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t LOOPS_PER_NORMAL_SECOND
cdef int64_t IDLE

@cython.locals(c=Columns, i=Py_ssize_t, slot=int64_t, works_here=bint)
cpdef count(WorldFields world)
