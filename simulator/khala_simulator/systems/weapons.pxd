cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport census
from khala_simulator.movement cimport turning
from khala_simulator.native cimport chance, columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.tables.stats cimport Damage
from khala_simulator.world.fields cimport WorldFields
from khala_simulator.world.shots cimport PendingHit, Shot

cdef double NOT_STARTED
cdef int64_t NOBODY

@cython.locals(n=Py_ssize_t, slot=Py_ssize_t, lost=bint)
cpdef fire(WorldFields world)
cdef void _count_down(Columns c, int64_t slot) noexcept
cdef bint _is_under_way(Columns c, int64_t slot) noexcept
cdef bint _takes_effect(Columns c, int64_t slot) noexcept
@cython.locals(i=Py_ssize_t, slot=int64_t, turrets=bint)
cdef _start_attacks(WorldFields world, Columns c)
@cython.locals(row=int64_t, weapons=int64_t, delay=double)
cdef _start(WorldFields world, Columns c, int64_t slot)
cdef double draw_delay(WorldFields world, Point jitter) except? -1.0
cdef bint _is_aimed(Columns c, int64_t slot) noexcept
cdef int64_t _choose_weapon(Columns c, int64_t slot) noexcept
@cython.locals(slot=int64_t, row=int64_t, is_beam=bint, backswing=double, slots=list)
cdef _take_effect(WorldFields world, list attackers)
@cython.locals(damage=Damage, slot=int64_t, target=int64_t, at=int64_t, is_kamikaze=bint, pending=list, loop=int64_t)
cdef _lay(WorldFields world, int64_t row, Py_ssize_t index, list attackers)
@cython.locals(shot=Shot)
cdef Shot _shoot(Columns c, int64_t slot, int64_t at, int64_t weapon, int64_t hit)
