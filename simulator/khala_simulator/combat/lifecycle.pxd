cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t INDEX_SHIFT
cdef int64_t TAG_BASE
cdef double FACING


@cython.locals(c=Columns, slot=int64_t, row=int64_t, at=int64_t, x=double, y=double, in_sight=bint, player=int64_t)
cpdef int64_t spawn(WorldFields world, object unit, int64_t owner, object point, double facing=*) except -1
@cython.locals(c=Columns, slot=int64_t)
cdef int64_t _free_slot(WorldFields world) except -1
@cython.locals(c=Columns)
cpdef remove(WorldFields world, int64_t slot)
@cython.locals(c=Columns, other=int64_t)
cdef _end_fights_with(WorldFields world, int64_t slot)
@cython.locals(other=int64_t)
cdef void _forget(int64_t* column, int64_t n, int64_t slot) noexcept
@cython.locals(c=Columns)
cpdef stow(WorldFields world, int64_t slot, int64_t carrier)
@cython.locals(c=Columns, x=double, y=double)
cpdef unstow(WorldFields world, int64_t slot, object point)
@cython.locals(c=Columns, shields=bint, life=bint, energy=bint, mortal=bint, hiding=bint, count=Py_ssize_t,
               slot=int64_t)
cpdef note_population(WorldFields world)
