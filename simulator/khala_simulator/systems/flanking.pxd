cimport cython
from libc.stdint cimport int64_t

from khala_simulator.movement cimport flow, grids
from khala_simulator.movement.flow cimport Flow, Walker
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.systems cimport acquire
from khala_simulator.world.fields cimport WorldFields

cdef int64_t AIR
cdef int64_t NOBODY
cdef int64_t GROUND_PLANE
cdef double NO_DISTANCE
cdef double REACH
cdef double LOOK
cdef double SQUEEZE
cdef double CHASE_SLACK
cdef int64_t DETOUR_LOOPS


@cython.locals(slot=int64_t, first=int64_t)
cdef lead(WorldFields world, list turning)
cdef bint _pursues(Columns c, int64_t slot) noexcept
cdef bint _chooses(Columns c, int64_t slot) noexcept
cdef bint _are_alike(Columns c, int64_t slot, int64_t other) noexcept
@cython.locals(first=int64_t, slot=int64_t, walker=Walker, around=Flow, width=double, reach=double, best=int64_t,
               picks=bint, i=Py_ssize_t, loop=int64_t)
cdef _follow(WorldFields world, Columns c, list kind)
cdef Walker _walker(Columns c, int64_t slot)
@cython.locals(slot=int64_t, x=double, y=double, distance=double)
cdef void _head_for(Columns c, Walker walker, int64_t loop) noexcept
cdef bint _is_in_the_way(Columns c, int64_t first, int64_t slot) noexcept
cdef bint _is_good(Columns c, int64_t first, int64_t slot, int64_t best) noexcept
@cython.locals(fights=bint)
cdef int64_t _danger(Columns c, int64_t foe) noexcept
