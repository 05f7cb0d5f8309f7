cimport cython
from libc.stdint cimport int64_t

from khala_simulator.movement cimport arrival
from khala_simulator.native cimport columns
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

@cython.locals(slot=Py_ssize_t)
cpdef carry_on(WorldFields world)
@cython.locals(c=Columns)
cdef bint _is_stuck(WorldFields world, int64_t slot) except -1
