cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport tags, targets
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t IDLE
cdef int64_t ATTACK_UNIT
cdef int64_t HOLD
cdef int64_t CAST
cdef int64_t GATHER
cdef int64_t RETURN
cdef int64_t WALKS
cdef int64_t LOOKS_AROUND
cdef int64_t SEEKS_FIGHTS
cdef int64_t NEEDS_TARGET


@cython.locals(c=Columns, units=tuple)
cdef _soon(WorldFields world, int64_t slot)
@cython.locals(c=Columns, step=double)
cpdef bint can_move(WorldFields world, int64_t slot) except -1
@cython.locals(c=Columns, armed=bint)
cpdef bint can_attack(WorldFields world, int64_t slot) except -1
@cython.locals(c=Columns, units=tuple)
cpdef bint can_reach(WorldFields world, int64_t slot, int64_t victim) except -1
cdef bint _commandable(object unit) except -1
@cython.locals(c=Columns, waiting=list)
cdef bint _give(WorldFields world, int64_t slot, object wanted, bint queue) except -1
@cython.locals(own=int64_t)
cdef _of_its_own(WorldFields world, int64_t row, object order)
@cython.locals(c=Columns, kind=int64_t, target=int64_t, opponent=int64_t, fights_on=bint, attacks=bint, casts=bint)
cpdef begin(WorldFields world, int64_t slot, object order)
@cython.locals(target=int64_t, goal=memory.Point, x=double, y=double)
cdef bint _leads_away(Columns c, int64_t slot) except -1
@cython.locals(x=double, y=double)
cdef memory.Point _point(object given, memory.Point place) except *
