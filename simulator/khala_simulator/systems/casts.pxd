cimport cython

from khala_simulator.native cimport columns

@cython.locals(slot=Py_ssize_t)
cpdef carry_on(object world)
