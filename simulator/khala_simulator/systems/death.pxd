cimport cython

from khala_simulator.native cimport columns, memory
from khala_simulator.world.fields cimport WorldFields

@cython.locals(dead=list)
cpdef bury(WorldFields world)
@cython.locals(i=Py_ssize_t)
cdef list _find_dead(WorldFields world)
