cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport census, targets
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t AIR_PLANE
cdef int64_t GROUND_PLANE
cdef int64_t IDLE
cdef int64_t ATTACK_MOVE
cdef int64_t PATROL
cdef double PRIORITY_WEIGHT
cdef double THREAT_WEIGHT
cdef double TOP_RANK
cdef double OUT_OF_SIGHT
cdef double ROUNDING
cdef int64_t SCAN_PERIOD
cdef int64_t HELP_PERIOD
cdef double HELP_RADIUS
cdef double LEASH_RADIUS
cdef double LEASH_RESET
cdef double GUARD_MARGIN
cdef int64_t BLOCKED_LOOPS
cdef int64_t ANYBODY


cdef class _Foes:
    cdef Py_ssize_t room
    cdef tuple arrays
    cdef int64_t* slot
    cdef Point* place
    cdef double* radius
    cdef int64_t* planes
    cdef double* rank
    cdef int64_t* threatens
    cdef int64_t* only
    cdef Py_ssize_t count
    cdef double widest
    cdef double* ranges
    cdef int64_t first
    cdef bint filters
    cdef bint zones

    @cython.locals(c=Columns, i=Py_ssize_t, slot=int64_t)
    cdef look(self, WorldFields world, int64_t player)


@cython.locals(loop=int64_t, slot=int64_t, player=int64_t)
cpdef choose_targets(WorldFields world)
@cython.locals(target=int64_t)
cdef bint _is_due(Columns c, int64_t slot, int64_t loop) noexcept
cdef bint _loses(Columns c, int64_t slot) noexcept
cdef bint _seeks_fights(Columns c, int64_t slot) noexcept
cdef bint _stays(Columns c, int64_t slot) noexcept
cdef bint _has_turret(Columns c, int64_t slot) noexcept
cdef double _squared_distance_from_guard(Columns c, int64_t slot) noexcept
@cython.locals(too_far=bint)
cdef bint _gives_up(Columns c, int64_t slot) noexcept
@cython.locals(away=bint)
cdef void _slip_leash(Columns c, int64_t slot) noexcept
@cython.locals(foes=_Foes)
cdef _Foes _foes_of(WorldFields world, int64_t player)
cdef bint is_foe(Columns c, int64_t player, int64_t slot) noexcept
cdef int64_t _foe_of(Columns c, int64_t slot) noexcept
@cython.locals(threatens=bint)
cdef double rank_of(Columns c, int64_t seeker, int64_t foe) noexcept
@cython.locals(slot=int64_t, foe=int64_t)
cdef _seek(WorldFields world, Columns c, int64_t player, list seekers)
@cython.locals(now=int64_t, is_free=bint, best=int64_t, rank=double, rank_now=double)
cdef int64_t _choose(Columns c, _Foes foes, int64_t slot) noexcept
@cython.locals(planes=int64_t, margin=double, on_ground=double, in_air=double, best=int64_t, best_gap=double,
               best_rank=double, place=Point, radius=double, farthest=double, i=Py_ssize_t, foe=int64_t, x=double,
               y=double, gap=double, sight=double, only=int64_t, threat=double, rank=double)
cdef (int64_t, double) _find_best(Columns c, _Foes foes, int64_t slot, bint in_reach) noexcept
cdef bint _may_aim(Columns c, int64_t slot, int64_t foe, double gap) noexcept
@cython.locals(on_ground=bint, row=int64_t, touch=double)
cdef bint _reaches(Columns c, _Foes foes, int64_t slot, int64_t foe, double gap) noexcept
cdef _take(WorldFields world, Columns c, int64_t slot, int64_t target)
@cython.locals(loop=int64_t, victim=int64_t, attacker=int64_t, friend=int64_t, i=Py_ssize_t)
cdef _answer(WorldFields world, Columns c)
cdef bint _hears(Columns c, int64_t friend, int64_t victim) noexcept
@cython.locals(roams=bint, is_free=bint)
cdef _turn_on(WorldFields world, Columns c, int64_t slot, int64_t attacker)
cdef _flee(WorldFields world, int64_t victim, int64_t attacker)
