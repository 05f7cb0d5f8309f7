cimport cython
from libc.stdint cimport int64_t

from khala_simulator.movement cimport grids
from khala_simulator.movement.grids cimport SurfaceGrid
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.systems cimport flanking
from khala_simulator.world.fields cimport WorldFields

cdef double* FAN_COS
cdef double* FAN_SIN
cdef int64_t SIDE
cdef int64_t FAN
cdef double SEEN_AHEAD
cdef double TOLERANCE
cdef int64_t STRIPES
cdef int64_t AIR
cdef int64_t LED
cdef int64_t CROWD_STALL
cdef double DETOUR_LOOK
cdef int64_t DETOUR_PERIOD
cdef int64_t DETOUR_LOOPS
cdef int64_t FLANK_PERIOD
cdef int64_t NOBODY


@cython.locals(loop=int64_t, slot=int64_t)
cpdef find_headings(WorldFields world)
cdef bint _flows(Columns c, int64_t slot) noexcept
@cython.locals(end=int64_t, i=Py_ssize_t, slot=int64_t, beside=double, turn=double, standing=_Standing)
cpdef begin(WorldFields world, object slots, object shift)
@cython.locals(crowd=_Crowd, loop=int64_t, stalled=int64_t, slot=int64_t, x=double, y=double, size=double, grid=SurfaceGrid, turn=int64_t)
cdef _look(WorldFields world, Columns c, list turning)
@cython.locals(turn=int64_t)
cdef int64_t _first_free(Columns c, _Crowd crowd, SurfaceGrid grid, int64_t slot, Point way) noexcept
cdef Point _heading(Point way, int64_t turn, double side) noexcept
cdef bint _is_ground(SurfaceGrid grid, Point start, Point heading) noexcept
cdef int64_t _stripe(double x) noexcept
@cython.locals(crowd=_Crowd)
cdef _Crowd _crowd_of(WorldFields world)
cdef bint _is_body(Columns c, int64_t slot) noexcept


@cython.final
cdef class _Standing:
    cdef tuple _arrays
    cdef Point* _places
    cdef double* _terms
    cdef Py_ssize_t _many
    @cython.locals(i=Py_ssize_t, x=double, y=double, is_ahead=bint)
    cdef double to_the_left(self, Point at, Point way) noexcept


@cython.final
cdef class _Crowd:
    cdef Py_ssize_t room
    cdef tuple _arrays
    cdef int64_t* _begin
    cdef int64_t* _slot
    cdef int64_t* _bits
    cdef Point* _place
    cdef Point* _step
    cdef double* _separation
    cdef Point* _offset
    cdef double* _apart
    cdef Py_ssize_t _many
    cdef double _widest
    @cython.locals(c=Columns, i=Py_ssize_t, slot=int64_t, stripe=int64_t, place=int64_t)
    cdef look(self, WorldFields world)
    @cython.locals(separation=double, bits=int64_t, farthest=double, many=Py_ssize_t, i=int64_t, x=double, y=double,
                   apart=double, seen=double)
    cdef void look_around(self, Columns c, int64_t slot, Point way) noexcept
    @cython.locals(i=Py_ssize_t, along=double, across=double, reach=double)
    cdef bint lets_pass(self, Point heading) noexcept
