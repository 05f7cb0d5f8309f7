cimport cython
from libc.stdint cimport int64_t

from khala_simulator.abilities cimport casting, commands
from khala_simulator.native cimport columns
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t NO_TAG
cdef int64_t UNIT


cpdef meant(WorldFields world, int64_t slot, object requested)
cdef tuple _meant(WorldFields world, int64_t slot, object requested)
@cython.locals(target=int64_t)
cpdef judge(WorldFields world, object player, object command)
cdef bint _obeys(WorldFields world, int64_t slot, int64_t player, bint all_obey) except -1
cdef _refuse(object command, object why)
cdef _without_snapshot(WorldFields world, object player, object command)
cdef _on_the_map(WorldFields world, object command)
@cython.locals(slot=int64_t)
cdef list _groups(WorldFields world, list slots, object requested)
@cython.locals(aim=int64_t, allowed=int64_t, c=Columns)
cdef _aim_result(WorldFields world, int64_t player, object ability, object command, int64_t target)
cdef _judge_cast(WorldFields world, int64_t slot, object ability, object command, int64_t target, object known)
cdef _cant_attack(WorldFields world, int64_t slot, int64_t target)
