cimport cython
from libc cimport math
from libc.stdint cimport int64_t

from khala_simulator.combat cimport census
from khala_simulator.movement cimport turning
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.world.fields cimport WorldFields

cdef double TURNING_CIRCLES
cdef double NO_DISTANCE
cdef object NO_CREEP


@cython.final
cdef class _Walks:
    cdef Py_ssize_t room
    cdef tuple arrays
    cdef int64_t* slot
    cdef Point* way
    cdef double* speed
    cdef double* step
    cdef double* left
    cdef double* error_cos


@cython.locals(n=Py_ssize_t, slot=Py_ssize_t, walking=Py_ssize_t, drifts=bint, anyone=bint)
cpdef move(WorldFields world)
@cython.locals(i=Py_ssize_t, slot=int64_t)
cdef _face_targets(WorldFields world, Columns c)
cdef bint _coasts(Columns c, int64_t slot) noexcept
cdef void _drift(Columns c, int64_t slot) noexcept
@cython.locals(walks=_Walks)
cdef _Walks _walks_of(WorldFields world, Py_ssize_t walking)
@cython.locals(walks=_Walks, creeps=bint, width=int64_t, height=int64_t, late=bint, i=Py_ssize_t, slot=int64_t, top_speed=double)
cdef _walk(WorldFields world, Columns c, Py_ssize_t walking, bint brakers)
@cython.locals(column=int64_t, row=int64_t)
cdef int64_t _cell(Point at, int64_t width, int64_t height) noexcept
@cython.locals(slot=int64_t, speed=double, left=double)
cdef bint _choose(Columns c, _Walks walks, Py_ssize_t i, double top_speed, bint brakers, list queue) except -1
@cython.locals(slot=int64_t, standing=bint, late=bint, cos_step=double, sin_step=double, swings=bint)
cdef void _turn(Columns c, _Walks walks, Py_ssize_t i) noexcept
