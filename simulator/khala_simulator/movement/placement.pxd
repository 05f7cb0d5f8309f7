cimport cython
from libc.stdint cimport int64_t

from khala_simulator.movement cimport grids
from khala_simulator.movement.grids cimport SurfaceGrid
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY


@cython.locals(
    x0=double, y0=double, x1=double, y1=double, px=double, py=double, grid=SurfaceGrid, c=Columns, reach=double,
    n=int64_t, i=int64_t, count=int64_t, at=Point
)
cdef _search(WorldFields world, object unit, object point, object radius, int64_t ignoring, int64_t most, double apart)
@cython.locals(i=int64_t, slot=int64_t, x=double, y=double, apart=double)
cdef bint _is_clear(Columns c, int64_t* slots, int64_t n, Point at, double reach) noexcept
@cython.locals(i=int64_t, x=double, y=double)
cdef bint _is_apart(Point* places, int64_t count, Point at, double apart) noexcept
