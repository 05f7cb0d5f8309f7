cimport cython
from libc.stdint cimport int64_t

from khala_simulator.abilities cimport commands
from khala_simulator.combat cimport tags
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.smac.fighters cimport Fighters
from khala_simulator.world.fields cimport WorldFields

cdef int64_t HEAL
cdef int64_t PLAYER
cdef int64_t NOBODY
cdef int64_t NO_OP
cdef int64_t STOP_ACTION
cdef int64_t FIRST_MOVE
cdef int64_t FIRST_TARGET
cdef int64_t NO_TAG
cdef int64_t STOP
cdef int64_t MOVE
cdef int64_t ATTACK
cdef int64_t KINDS
cdef int64_t IDLE
cdef int64_t WALK
cdef int64_t ATTACK_UNIT


@cython.locals(agent=int64_t, action=int64_t, tag=int64_t)
cpdef give_orders(WorldFields world, Fighters fighters, object actions, double move_amount)
@cython.locals(x=double, y=double, dx=double, dy=double)
cdef _goal(Fighters fighters, int64_t agent, int64_t way, double far)
@cython.locals(c=Columns, slot=int64_t)
cdef _order(WorldFields world, int64_t tag, int64_t ability, int64_t target, object point)
@cython.locals(kind=int64_t, usual=int64_t)
cdef bint _has(WorldFields world, int64_t row, int64_t ability) except -1
@cython.locals(victim=int64_t)
cdef bint _may_attack(Columns c, int64_t tag) noexcept
