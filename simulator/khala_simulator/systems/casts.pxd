cimport cython

from khala_simulator.native cimport columns
from khala_simulator.world.fields cimport WorldFields

@cython.locals(slot=Py_ssize_t)
cpdef carry_on(WorldFields world)
