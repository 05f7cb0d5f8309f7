cimport cython

from khala_simulator.native cimport columns, memory

@cython.locals(dead=list)
cpdef bury(object world)
@cython.locals(i=Py_ssize_t)
cdef list _find_dead(object world)
