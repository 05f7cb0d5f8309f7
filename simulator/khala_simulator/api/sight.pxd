cimport cython
from libc.stdint cimport int64_t

from khala_simulator.maps.heights cimport Heights
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.systems cimport vision
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t SELF
cdef int64_t NEUTRAL
cdef int64_t ENEMY
cdef int64_t VISIBLE
cdef int64_t HIDDEN
cdef int64_t UNKNOWN
cdef int64_t CLOAKED
cdef int64_t DETECTED
cdef int64_t NOT_CLOAKED
cdef int64_t ALLIED
cdef int64_t IDLE
cdef int64_t VISIBLE_CELL

@cython.locals(width=Py_ssize_t, height=Py_ssize_t, fogged=bint, observes=bint, n=Py_ssize_t, last=Py_ssize_t, i=Py_ssize_t,
               slot=int64_t, own=bint, hides=int64_t, seen=bint)
cdef _units_seen(WorldFields world, object types, int64_t player, bint show_cloaked, bint through_fog)
cdef int64_t _cloak(Columns c, int64_t slot, bint own, bint uncovered) noexcept
@cython.locals(n=Py_ssize_t, type_count=int64_t, neutral=int64_t, observes=bint, i=Py_ssize_t)
cdef _make_sight(WorldFields world, object types, Columns c, int64_t player, object slot, object cloak, int64_t* clear)
cdef _fakes(WorldFields world, int64_t player, object slot, object alliance, object fakes)
@cython.locals(makes=bint, i=Py_ssize_t, slot=int64_t)
cdef _active(WorldFields world, Columns c, int64_t* slots, int64_t* clear, Py_ssize_t n)
@cython.locals(i=Py_ssize_t)
cdef _heights(Heights heights, object pos, double* above, int64_t* rows, Py_ssize_t n)
@cython.locals(i=Py_ssize_t)
cdef _pick_clear(double* column, int64_t* at, int64_t* clear, Py_ssize_t n)
@cython.locals(i=Py_ssize_t)
cdef _pick_floats(double* column, int64_t* at, Py_ssize_t n)
@cython.locals(i=Py_ssize_t)
cdef _pick_ints(int64_t* column, int64_t* at, Py_ssize_t n)
@cython.locals(i=Py_ssize_t)
cdef _pick_bools(boolean* column, int64_t* at, Py_ssize_t n)
@cython.locals(i=Py_ssize_t)
cdef _pick_points(Point* column, int64_t* at, Py_ssize_t n)
