cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields


@cython.locals(slots=list, anyone_has_buffs=bint)
cpdef run(WorldFields world)
@cython.locals(c=Columns, i=Py_ssize_t, slot=int64_t)
cdef _look_over(WorldFields world)
