cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns


@cython.locals(shields=bint, life=bint, energy=bint, loop=int64_t, slot=Py_ssize_t)
cpdef regenerate(object world)
