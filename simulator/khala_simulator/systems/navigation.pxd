cimport cython
from libc.stdint cimport int64_t

from khala_simulator.movement cimport grids, ways
from khala_simulator.movement.grids cimport SurfaceGrid, Lines
from khala_simulator.movement.ways cimport Way
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields

cdef double CORNER_REACHED
cdef double NEAR_CORNER
cdef double HEADWAY
cdef double NEAR_SIDE
cdef double NO_DISTANCE
cdef int64_t LOOK_PERIOD
cdef int64_t PATH_PERIOD
cdef int64_t AIR
cdef int64_t LAYERS


@cython.locals(loop=int64_t, latest=int64_t, due=int64_t, slot=int64_t)
cpdef find_ways(WorldFields world)
@cython.locals(i=int64_t, slot=int64_t, layer=int64_t, many=int64_t, loop=int64_t, soon=bint)
cdef _check(WorldFields world, Columns c, int64_t due, int64_t latest)
cdef double _away(Point point, Point other) noexcept
@cython.locals(loop=int64_t, i=int64_t, slot=int64_t)
cdef _look_over(WorldFields world, Columns c, int64_t* slots, int64_t n, int64_t layer)
@cython.locals(grid=SurfaceGrid, lines=Lines, i=int64_t, crooked=bint)
cdef _go_straight(WorldFields world, Columns c, int64_t* slots, int64_t n, int64_t layer)
cdef Point _stopping_point(Columns c, int64_t slot) noexcept
@cython.locals(i=int64_t, slot=int64_t, way=Way)
cdef _go_round(WorldFields world, Columns c, SurfaceGrid grid, int64_t* slots, int64_t n)
@cython.locals(centre=Point)
cdef void _turn_corner(Columns c, SurfaceGrid grid, Way way) noexcept
@cython.locals(i=Py_ssize_t, best=Py_ssize_t, cost=double, least=double)
cdef int64_t _nearest(SurfaceGrid grid, object point, int64_t part, Point start) except -1
