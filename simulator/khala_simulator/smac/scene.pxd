cimport cython
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.native cimport memory
from khala_simulator.native.memory cimport boolean
from khala_simulator.smac.fighters cimport Fighters
from khala_simulator.world.fields cimport WorldFields

cdef double SHOOT_RANGE
cdef double SIGHT_RANGE
cdef int64_t NO_OP
cdef int64_t STOP
cdef int64_t FIRST_MOVE
cdef int64_t FIRST_TARGET
cdef int64_t LIFE_MAX
cdef int64_t SHIELDS
cdef int64_t ENERGY
cdef int64_t COOLDOWN


@cython.final
cdef class BattleScene:
    cdef readonly object layout
    cdef readonly object board
    cdef readonly Fighters fighters
    cdef readonly object masks
    cdef readonly object seen
    cdef readonly object last
    cdef tuple _arrays
    cdef int64_t n
    cdef int64_t agents
    cdef int64_t actions
    cdef double move_amount
    cdef int64_t margin
    cdef int64_t rows
    cdef bint own_shields
    cdef bint enemy_shields
    cdef bint all_health
    cdef bint own_health
    cdef bint shows_last
    cdef bint timed
    cdef bint shows_paths
    cdef bint shows_heights
    cdef double middle_x
    cdef double middle_y
    cdef double wide
    cdef double high
    cdef boolean* can
    cdef boolean* sees
    cdef int64_t* chosen
    cdef double* distances
    cdef boolean* open
    cdef double* walkable
    cdef double* heights

    cdef _bind(self)
    @cython.locals(f=Fighters, x=cython.p_double, agent=int64_t, unit=int64_t, across=double, along=double,
                   distance=double)
    cpdef look(self)
    @cython.locals(f=Fighters, first=int64_t, action=int64_t, half=double, x=double, y=double, heals=bint,
                   unit=int64_t, last=int64_t, target=int64_t, near=bint)
    cdef void _allow(self, int64_t agent) noexcept
    @cython.locals(column=int64_t, row=int64_t)
    cdef int64_t _cell(self, double x, double y) noexcept
    @cython.locals(agent=int64_t, action=int64_t)
    cdef void choose(self, int64_t* actions) noexcept
    cpdef take(self, object actions)
    cpdef see(self, WorldFields world, object types)
    @cython.locals(i=int64_t)
    cpdef show(self, object observations, object state, object masks, double progress)
    @cython.locals(cells=cython.p_float, size=int64_t, i=int64_t, agent=int64_t, total=int64_t)
    cpdef observe(self, object out, double progress)
    @cython.locals(action=int64_t, enemy=int64_t, target=int64_t, first=bint, ally=int64_t)
    cdef _observe(self, float* cells, int64_t at, int64_t agent)
    cdef int64_t _surround(self, float* cells, int64_t at, int64_t agent) except -1
    @cython.locals(x=int64_t, y=int64_t)
    cdef int64_t _around(self, int64_t agent, double across, double along) noexcept
    @cython.locals(f=Fighters, pair=int64_t)
    cdef int64_t _see(self, float* cells, int64_t at, int64_t agent, int64_t unit, bint first, bint shields,
                      bint acts) noexcept
    @cython.locals(f=Fighters, bit=int64_t)
    cdef int64_t _vitals(self, float* cells, int64_t at, int64_t unit, bint health, bint shields) noexcept
    @cython.locals(cells=cython.p_float, numbers=cython.p_double, at=int64_t, i=int64_t, agent=int64_t, action=int64_t)
    cpdef describe(self, object out, double progress)
    @cython.locals(own=int64_t)
    cpdef units(self)
    @cython.locals(own=int64_t, bits=int64_t, cells=cython.p_double, at=int64_t, unit=int64_t)
    cdef cnp.ndarray _units(self)
    @cython.locals(f=Fighters, n=int64_t, is_agent=bint, shields=bint, end=int64_t, i=int64_t, charge=double,
                   bit=int64_t)
    cdef int64_t _unit(self, double* cells, int64_t at, int64_t unit) noexcept
