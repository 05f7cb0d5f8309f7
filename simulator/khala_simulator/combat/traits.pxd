cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport targets, weapon_choice
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY


cpdef check_slot(WorldFields world, int64_t slot)
cpdef refresh(WorldFields world, int64_t slot)
@cython.locals(c=Columns)
cdef _note(WorldFields world, int64_t slot)
@cython.locals(c=Columns, row=int64_t, at=int64_t, kinds=list)
cpdef body_traits(WorldFields world, int64_t slot)
cdef _rearm(WorldFields world, int64_t slot, int64_t target)
@cython.locals(c=Columns, carrier=int64_t)
cdef _shelter(WorldFields world, int64_t slot)
@cython.locals(c=Columns, walking=double, still=double, walking_deg=double, still_deg=double)
cdef _turning(WorldFields world, int64_t slot, object unit)
cdef double _braking(object unit) except? -1.0
cpdef list kinds_on(WorldFields world, int64_t slot)
@cython.locals(c=Columns)
cdef _plain(WorldFields world, int64_t slot)
