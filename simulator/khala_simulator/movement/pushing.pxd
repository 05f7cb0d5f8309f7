cimport cython
from libc.stdint cimport int64_t

from khala_simulator.movement cimport contacts
from khala_simulator.movement.contacts cimport Crowd
from khala_simulator.native cimport memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point

cdef int64_t NOBODY
cdef double OVERLAP_PRESSED
cdef double SAME_POINT
cdef double STIR
cdef double IMMOBILE_YIELDING
cdef double EVEN
cdef int64_t AIR
cdef double PUSH_FIRM
cdef double PUSH_IDLE
cdef double PUSH_RANGED
cdef double PUSH_MELEE
cdef double MELEE
cdef double PUSH_AHEAD
cdef double PUSH_LIMIT
cdef int64_t PUSH_ROUNDS
cdef double FLYER_DRIFT
cdef double FLYER_DRIFT_LIMIT


@cython.locals(i=Py_ssize_t, drifting=bint)
cdef bint push_apart(Crowd crowd, Columns c, int64_t* slots) except -1
@cython.locals(i=Py_ssize_t, k=Py_ssize_t, x=double, y=double)
cdef _part(Crowd crowd)

@cython.locals(k=Py_ssize_t, kept=Py_ssize_t, drifting=bint)
cdef bint _drift_apart(Crowd crowd, Columns c, int64_t* slots) noexcept
cdef bint _flies(Crowd crowd, Columns c, int64_t* slots, Py_ssize_t k) noexcept
@cython.locals(k=Py_ssize_t, drifting=bint)
cdef bint _drift_firsts(Crowd crowd, Columns c, int64_t* slots) noexcept
@cython.locals(k=Py_ssize_t, drifting=bint)
cdef bint _drift_seconds(Crowd crowd, Columns c, int64_t* slots) noexcept
cdef bint _drifts(Crowd crowd, Columns c, int64_t* slots, Py_ssize_t k, int64_t slot) noexcept
@cython.locals(depth=double, push=double)
cdef bint _drift(Crowd crowd, Py_ssize_t k, Py_ssize_t body, double sign) noexcept

@cython.locals(i=Py_ssize_t, k=Py_ssize_t, slot=int64_t, mine=double, theirs=double)
cdef void _share_out(Crowd crowd, Columns c, int64_t* slots) noexcept
cdef double _standing_yields(Columns c, int64_t slot) noexcept
cdef double _squared_distance_left(Columns c, int64_t slot) noexcept
@cython.locals(i=Py_ssize_t, n=Py_ssize_t, overlapping=Py_ssize_t, deepest=double)
cdef void _relax(Crowd crowd, int64_t rounds) noexcept
@cython.locals(k=Py_ssize_t, overlapping=Py_ssize_t, deepest=double, distance=double)
cdef (Py_ssize_t, double) _measure(Crowd crowd) noexcept
cdef void _measure_offset(Crowd crowd, Py_ssize_t k) noexcept
@cython.locals(n=Py_ssize_t)
cdef void _push_firsts(Crowd crowd, Py_ssize_t overlapping) noexcept
@cython.locals(n=Py_ssize_t)
cdef void _push_seconds(Crowd crowd, Py_ssize_t overlapping) noexcept
cdef void _move(Point* points, Py_ssize_t i, Point offset, double part) noexcept
@cython.locals(k=Py_ssize_t, deep=bint)
cdef bint _step_back(Crowd crowd) noexcept
cdef void _put_back(Crowd crowd, Py_ssize_t body) noexcept
@cython.locals(i=Py_ssize_t, limited=bint, part=double)
cdef void _limit(Crowd crowd) noexcept
