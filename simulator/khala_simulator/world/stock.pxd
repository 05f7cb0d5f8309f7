cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY


@cython.locals(c=Columns, n=Py_ssize_t, count=Py_ssize_t, slot=Py_ssize_t, shields=bint, life=bint, energy=bint,
               mortal=bint, hiding=bint)
cpdef look_over(WorldFields world)
@cython.locals(c=Columns, slot=Py_ssize_t)
cpdef forget(WorldFields world, int64_t gone)
