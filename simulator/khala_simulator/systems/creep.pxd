cimport cython

from khala_simulator.native cimport columns, memory
from khala_simulator.world.fields cimport WorldFields


cpdef spread(WorldFields world)
@cython.locals(i=Py_ssize_t)
cdef list _of_types(WorldFields world, object wanted)
