cimport cython
from libc.stdint cimport int64_t

from khala_simulator.abilities cimport commands
from khala_simulator.native cimport columns
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY


cpdef bint is_modelled(object ability) except -1
cpdef as_is(WorldFields world, int64_t slot, object ability)
cdef _unready(WorldFields world, int64_t slot, object ability)
@cython.locals(c=Columns)
cdef _ordinary_refusal(WorldFields world, int64_t slot, object ability)
cdef _unaffordable(WorldFields world, int64_t slot, object ability)
