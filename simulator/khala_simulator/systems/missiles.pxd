cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport damage
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.systems cimport weapons
from khala_simulator.world.fields cimport WorldFields
from khala_simulator.world.shots cimport Missile, Shot

cdef int64_t NOBODY
cdef double NO_DISTANCE

@cython.locals(missile=Missile, shot=Shot)
cpdef fly(WorldFields world)
cdef bint _step(Columns c, Missile missile) noexcept
@cython.locals(delay=double)
cdef _cool_down(WorldFields world, Shot shot)
cdef launch(WorldFields world, Shot shot, object hit)
@cython.locals(after=Shot, slot=int64_t)
cdef _bounce(WorldFields world, Shot shot, tuple hits)
