cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY


@cython.locals(reach=double, n=int64_t, i=int64_t, found=list)
cdef tuple _search(WorldFields world, object unit, object point, object radius, int64_t ignoring, int64_t most, double apart)
@cython.locals(i=int64_t, slot=int64_t, x=double, y=double, apart=double)
cdef bint _is_clear(Columns c, int64_t* slots, int64_t n, Point at, double reach) noexcept
@cython.locals(other=int64_t, x=double, y=double)
cdef bint _is_apart(Point* at, list found, int64_t i, double apart) except -1
