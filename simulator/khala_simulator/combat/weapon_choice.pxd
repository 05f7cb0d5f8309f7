cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields


@cython.locals(c=Columns, owner=int64_t, first=int64_t, scan=cython.p_double, weapons=list)
cpdef weapon_traits(WorldFields world, int64_t slot, object unit, object kinds)
cdef _first_that_reaches(list weapons, object plane)
cdef _closer_weapon(list weapons, object ground)
