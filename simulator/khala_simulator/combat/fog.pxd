cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NEUTRAL
cdef int64_t VISIBLE

@cython.locals(first=bint, i=Py_ssize_t, slot=int64_t, n=Py_ssize_t)
cpdef remember(WorldFields world, int64_t player)
@cython.locals(i=Py_ssize_t)
cdef _uncover(WorldFields world, int64_t player, object known)
cdef _cover(WorldFields world, object known, list hidden)
@cython.locals(i=Py_ssize_t, slot=int64_t, pos=Point, heading=Point)
cdef _note(Columns c, object known, int64_t* slots, Py_ssize_t n)
@cython.locals(i=Py_ssize_t, slot=int64_t)
cdef tuple _numbers(Columns c, int64_t* slots, Py_ssize_t n)
@cython.locals(i=Py_ssize_t, slot=int64_t)
cdef bint _is_noted(Columns c, int64_t* slots, Py_ssize_t n, tuple noted) except -1
