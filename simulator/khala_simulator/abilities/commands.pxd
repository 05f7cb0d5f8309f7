cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport tags, targets
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.tables.stats cimport Stats
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t IDLE
cdef int64_t WALK
cdef int64_t ATTACK_UNIT
cdef int64_t HOLD
cdef int64_t CAST
cdef int64_t GATHER
cdef int64_t RETURN
cdef int64_t WALKS
cdef int64_t LOOKS_AROUND
cdef int64_t SEEKS_FIGHTS
cdef int64_t NEEDS_TARGET
cdef int64_t KINDS
cdef int64_t MOVE
cdef int64_t PATROL
cdef int64_t HOLD_POSITION
cdef int64_t SCAN_MOVE
cdef int64_t ATTACK
cdef int64_t NO_TAG


cpdef bint send(WorldFields world, int64_t slot, object point, bint queue=*) except -1
@cython.locals(victim=int64_t)
cpdef bint set_on(WorldFields world, int64_t slot, int64_t target, bint queue=*) except -1
@cython.locals(c=Columns)
cpdef bint halt(WorldFields world, int64_t slot, bint queue=*) except -1
@cython.locals(c=Columns, now=int64_t)
cdef int64_t _soon(WorldFields world, int64_t slot) except -1
@cython.locals(row=int64_t, stats=Stats, step=double)
cpdef bint can_move(WorldFields world, int64_t slot) except -1
@cython.locals(c=Columns, armed=bint)
cpdef bint can_attack(WorldFields world, int64_t slot) except -1
@cython.locals(c=Columns)
cpdef bint can_reach(WorldFields world, int64_t slot, int64_t victim) except -1
cdef bint _commandable(WorldFields world, int64_t row) except -1
@cython.locals(x=double, y=double)
cdef tuple _inside(WorldFields world, object point)
@cython.locals(c=Columns, ability=int64_t, waits=bint)
cdef bint _give(WorldFields world, int64_t slot, int64_t kind, int64_t general, int64_t target, object point,
                object origin, bint queue) except -1
@cython.locals(own=int64_t)
cdef int64_t _of_its_own(WorldFields world, int64_t row, int64_t kind, int64_t general) except -1
cpdef begin(WorldFields world, int64_t slot, object order)
@cython.locals(c=Columns, target=int64_t, opponent=int64_t, fights_on=bint, attacks=bint, casts=bint)
cdef _begin(WorldFields world, int64_t slot, int64_t kind, int64_t ability, int64_t tag, object point, object origin)
@cython.locals(target=int64_t, goal=memory.Point, x=double, y=double)
cdef bint _leads_away(Columns c, int64_t slot) except -1
@cython.locals(x=double, y=double)
cdef memory.Point _point(object given, memory.Point place) except *
