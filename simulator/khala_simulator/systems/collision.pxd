cimport cython
from libc cimport math
from libc.stdint cimport int64_t

from khala_simulator.movement cimport contacts, grids, pushing
from khala_simulator.movement.contacts cimport Crowd
from khala_simulator.movement.grids cimport SurfaceGrid
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields

cdef int64_t AIR
cdef double SAME_POINT
cdef double EDGE_MARGIN
cdef double BLOCKED_SHARE
cdef int64_t DETOUR_AFTER
cdef double PUSH_LIMIT


@cython.locals(moved=bint, i=Py_ssize_t)
cpdef separate(WorldFields world)
@cython.locals(i=Py_ssize_t, x0=double, y0=double, x1=double, y1=double, last=int64_t, layer=int64_t, grid=SurfaceGrid)
cdef _keep_on_surfaces(WorldFields world, Crowd crowd, Columns c, int64_t* slots)
@cython.locals(i=Py_ssize_t, corner_x=double, corner_y=double, kept_x=double, kept_y=double, push=double)
cdef Point _off_walls(SurfaceGrid grid, Point at, int64_t cell, double room) noexcept
cdef Point _free_or_back(SurfaceGrid grid, Point before, Point after) except *
@cython.locals(x=double, y=double, part=double)
cdef Point _leave_wall(SurfaceGrid grid, Point before, Point after) except *
@cython.locals(i=Py_ssize_t, stuck=Py_ssize_t, along=double)
cdef _note_blocked(WorldFields world, Crowd crowd, Columns c, int64_t* slots)
