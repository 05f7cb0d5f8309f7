cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport damage
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields
from khala_simulator.world.shots cimport PendingHit, Shot, Sweep

cdef int64_t NOBODY
cdef double ON_TARGET

@cython.locals(sweep=Sweep)
cdef begin(WorldFields world, Shot shot, double begun)
@cython.locals(sweep=Sweep)
cpdef run(WorldFields world)
@cython.locals(s=Sweep)
cdef _drop_ended(WorldFields world)
cdef object _line(WorldFields world, Shot shot)
@cython.locals(shot=Shot, points=tuple, lag=double, loop=int64_t, first=Py_ssize_t, drawn=Py_ssize_t, i=Py_ssize_t,
               slot=int64_t, reached=Py_ssize_t, radius=double, affects=int64_t)
cdef _draw(WorldFields world, Sweep sweep)
@cython.locals(from_source=bint, reach=double, points=tuple, drawn=Py_ssize_t, i=Py_ssize_t, across=double, along=double)
cdef Py_ssize_t _place(WorldFields world, Shot shot, object line, Py_ssize_t first, Py_ssize_t end, Point* places) except -1
cdef Py_ssize_t _first_within(Columns c, Point* places, Py_ssize_t drawn, int64_t slot, double reach) noexcept
cdef _touch(WorldFields world, Sweep sweep, int64_t slot, double lag, double moment)
