cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport census, targets
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point

cdef int64_t NOBODY
cdef int64_t AIR_PLANE
cdef int64_t GROUND_PLANE
cdef int64_t IDLE
cdef int64_t ATTACK_MOVE
cdef int64_t PATROL
cdef double PRIORITY_WEIGHT
cdef double THREAT_WEIGHT
cdef double TOP_RANK
cdef double RANK_STEP
cdef double OUT_OF_SIGHT
cdef double ROUNDING
cdef int64_t SCAN_PERIOD
cdef int64_t LOOK_UP_PERIOD
cdef int64_t HELP_PERIOD
cdef double HELP_RADIUS
cdef double LEASH_RADIUS
cdef double LEASH_RESET
cdef double SWITCH_GAIN


cdef class _Foes:
    cdef tuple arrays
    cdef int64_t* slot
    cdef Point* place
    cdef double* radius
    cdef int64_t* planes
    cdef double* rank
    cdef int64_t* threatens
    cdef Py_ssize_t count
    cdef double widest
    cdef Py_ssize_t weapons
    cdef double* ranges
    cdef bint filters
    cdef bint zones


@cython.locals(loop=int64_t, looks_up=bint, slot=int64_t, player=int64_t)
cpdef choose_targets(object world)
cdef bint _is_due(Columns c, int64_t slot, int64_t loop, bint looks_up) noexcept
cdef bint _seeks_fights(Columns c, int64_t slot) noexcept
cdef bint _stays(Columns c, int64_t slot) noexcept
cdef double _squared_distance_from_guard(Columns c, int64_t slot) noexcept
@cython.locals(too_far=bint)
cdef bint _gives_up(Columns c, int64_t slot) noexcept
@cython.locals(away=bint)
cdef void _slip_leash(Columns c, int64_t slot) noexcept
cdef bint is_foe(Columns c, int64_t player, int64_t slot) noexcept
@cython.locals(threat=double)
cdef double rank_of(Columns c, int64_t seeker, int64_t foe) noexcept
cdef int64_t _threatened_planes(Columns c, int64_t foe) noexcept
@cython.locals(slot=int64_t, now=int64_t, foe=int64_t, rank_now=double, gap=double, worth=double, rank=double)
cdef _seek(object world, Columns c, int64_t player, list seekers)
cdef bint _is_better(Columns c, _Foes foes, int64_t slot, int64_t foe, double gap, double rise) noexcept
@cython.locals(planes=int64_t, on_ground=double, in_air=double, longest=double, best=int64_t, best_gap=double,
               best_worth=double, place=Point, radius=double, farthest=double, i=Py_ssize_t, foe=int64_t, x=double, y=double, gap=double,
               sight=double, worth=double)
cdef (int64_t, double, double) _find_best(Columns c, _Foes foes, int64_t slot) noexcept
cdef bint _may_aim(Columns c, int64_t slot, int64_t foe, double gap) noexcept
@cython.locals(ground=double, air=double)
cdef double _longest_reach(Columns c, _Foes foes, int64_t slot) noexcept
@cython.locals(on_ground=bint, row=int64_t, touch=double)
cdef bint _reaches(Columns c, _Foes foes, int64_t slot, int64_t foe, double gap) noexcept
cdef _take(object world, Columns c, int64_t slot, int64_t target)
@cython.locals(loop=int64_t, victim=int64_t, attacker=int64_t, friend=int64_t, i=Py_ssize_t)
cdef _answer(object world, Columns c)
cdef bint _hears(Columns c, int64_t friend, int64_t victim) noexcept
@cython.locals(roams=bint, is_free=bint)
cdef _turn_on(object world, Columns c, int64_t slot, int64_t attacker)
cdef _flee(object world, int64_t victim, int64_t attacker)
