cimport cython
from libc cimport math
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t GROUND_PLANE

@cython.locals(planes=int64_t, ground=int64_t, air=int64_t, row=int64_t, is_excluded=bint)
cpdef int64_t weapon_for(WorldFields world, int64_t slot, int64_t target) except -2
@cython.locals(row=int64_t, least=double, is_fixed=bint)
cpdef bint engage(WorldFields world, int64_t slot, int64_t target) except -1
cpdef take_other_weapon(WorldFields world, int64_t slot)
@cython.locals(plain=double, touch=double, target=int64_t)
cpdef measure_reach(WorldFields world, int64_t slot)
cpdef disengage(WorldFields world, int64_t slot)
cpdef drop_attack(WorldFields world, int64_t slot)
cdef bint inside_zone(Columns c, int64_t slot, int64_t target) noexcept
