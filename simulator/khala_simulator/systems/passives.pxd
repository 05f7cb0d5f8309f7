cimport cython

from khala_simulator.world.fields cimport WorldFields


@cython.locals(slots=list)
cpdef run(WorldFields world)
