cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef double WHOLE
cdef int64_t FOLLOW
cdef int64_t IDLE
cdef double BESIDE
cdef double GROWN_SHARE

@cython.locals(waits=bint, slot=Py_ssize_t)
cpdef run(WorldFields world)
cdef bint _is_worked(Columns c, int64_t slot, int64_t loop) noexcept
@cython.locals(loop=int64_t, slot=Py_ssize_t, site=int64_t)
cdef _note_builders(WorldFields world, Columns c)
cdef bint _is_work(WorldFields world, int64_t slot) except -1
cdef void _grow(Columns c, int64_t slot, bint at_once, bint has_walls) noexcept
cdef _finish(WorldFields world, int64_t slot)
