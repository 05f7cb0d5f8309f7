cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY


@cython.locals(c=Columns, live=list, slot=int64_t, shields=bint, life=bint, energy=bint, mortal=bint, hiding=bint)
cpdef call(WorldFields world)
@cython.locals(c=Columns, slot=int64_t)
cpdef int64_t free_slot(WorldFields world) except -1
@cython.locals(c=Columns, slot=int64_t)
cpdef list passengers(WorldFields world, int64_t carrier)
@cython.locals(c=Columns, other=int64_t)
cpdef forget(WorldFields world, int64_t slot)
@cython.locals(c=Columns, other=int64_t)
cpdef end_fights_with(WorldFields world, int64_t slot)
