cimport cython

from khala_simulator.world.fields cimport WorldFields


@cython.locals(done=Py_ssize_t)
cpdef Py_ssize_t advance(WorldFields world, Py_ssize_t loops=*, object systems=*) except -1
