cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport damage
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport boolean
from khala_simulator.systems cimport missiles, sweeps
from khala_simulator.world.fields cimport WorldFields
from khala_simulator.world.shots cimport PendingHit, Shot

cdef int64_t NOBODY

@cython.locals(loop=int64_t, pending=PendingHit, source=int64_t, c=Columns)
cpdef fall_due(WorldFields world)
@cython.locals(pending=PendingHit)
cdef bint _any_due(list hits, int64_t loop) noexcept
cdef bint _is_due(PendingHit pending, int64_t loop) noexcept
cdef void _follow(Columns c, boolean* kamikaze, PendingHit pending) noexcept
cdef _carry_out(WorldFields world, PendingHit pending)
