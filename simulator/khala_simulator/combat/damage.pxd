cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.tables.stats cimport Damage
from khala_simulator.world.fields cimport WorldFields
from khala_simulator.world.shots cimport Shot

cdef int64_t NOBODY
cdef int64_t AIR_PLANE
cdef int64_t GROUND_PLANE
cdef double BEHIND
cdef int64_t ALLIES
cdef int64_t NEUTRAL
cdef int64_t STRUCTURES
cdef int64_t OTHERS
cdef int64_t SOURCE
cdef int64_t TARGET
cdef int64_t ON_GROUND
cdef int64_t IN_AIR
cdef int64_t ANYWHERE
cdef double DAMAGE_MIN
cdef double ALL_ROUND_DEG

@cython.locals(slot=int64_t, damage=Damage)
cpdef hit_with(WorldFields world, Shot shot)
cdef Damage _damage_of(WorldFields world, Shot shot)
@cython.locals(damage=Damage)
cpdef hit_target(WorldFields world, Shot shot)
cdef _give_life(WorldFields world, int64_t slot)
@cython.locals(attributes=int64_t, amount=double)
cpdef strike(WorldFields world, int64_t source, int64_t owner, int64_t victim, Damage damage, double fraction=*)
@cython.locals(bit=int64_t, value=double, most=double)
cpdef double amount_against(Damage damage, int64_t attributes) except? -1.0
@cython.locals(side=int64_t, answer=double, held=double, at=int64_t, shield_armor=double, armor=double, least=double,
               absorbed=double, rest=double, reduced=double, wounded=double)
cpdef apply_damage(WorldFields world, int64_t source, int64_t owner, int64_t victim, double amount, str kind=*,
                   bint ignores_armor=*, double shield_bonus=*)
cdef _count(WorldFields world, int64_t owner, int64_t side, double absorbed, double wounded)
@cython.locals(i=Py_ssize_t, slot=int64_t, affects=int64_t, widest=double, radius=double, fraction=double, arc_deg=double)
cdef _splash(WorldFields world, Shot shot, Damage damage)
@cython.locals(beyond=bint)
cdef bint in_arc(double x, double y, double radius, double forward_x, double forward_y, double arc_deg) except -1
@cython.locals(from_source=bint, i=Py_ssize_t, slot=int64_t, affects=int64_t, reach=double, edge=double)
cpdef list found_by(WorldFields world, object search, Shot shot)
@cython.locals(bits=int64_t)
cdef int64_t bits_of(object affects) except -1
cdef bint touches(Columns c, int64_t affects, Shot shot, int64_t slot) noexcept
