cimport cython
from libc.stdint cimport int64_t, uint32_t

from khala_simulator.api cimport fields, wire
from khala_simulator.maps.heights cimport Heights
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef uint32_t ATTACK
cdef int64_t SELF
cdef int64_t NEUTRAL
cdef int64_t VISIBLE
cdef int64_t HIDDEN
cdef int64_t IDLE
cdef int64_t ATTACK_UNIT
cdef int64_t FOLLOW
cdef int64_t HOLD
cdef int64_t CAST


cdef class _View:
    cdef object units
    cdef WorldFields world
    cdef Columns c
    cdef Heights heights
    cdef wire.MessageWriter part
    cdef int64_t loop
    cdef Py_ssize_t top
    cdef double x0
    cdef double y0
    cdef bint makes
    cdef bint rallies
    cdef dict harvesters
    cdef dict buffs
    cdef dict lasting
    cdef int64_t* slot
    cdef int64_t* row
    cdef int64_t* tag
    cdef int64_t* type_id
    cdef int64_t* owner
    cdef int64_t* alliance
    cdef int64_t* display
    cdef int64_t* cloak
    cdef Point* pos
    cdef double* z
    cdef double* facing
    cdef double* radius
    cdef double* life
    cdef double* life_max
    cdef double* shields
    cdef double* shields_max
    cdef double* energy
    cdef double* energy_max
    cdef double* build_progress
    cdef boolean* flying
    cdef boolean* burrowed
    cdef boolean* hallucination
    cdef boolean* active
    cdef boolean* selected
    cdef boolean* on_screen
    cdef int64_t type_count
    cdef int64_t* type_ids
    cdef boolean* structure
    cdef boolean* armed
    cdef boolean* needs_power
    cdef boolean* minerals_in
    cdef boolean* vespene_in
    cdef int64_t* cargo
    cdef object level_table
    cdef int64_t* levels


cdef dict _buffs_by_row(object worn)
cdef dict _last_ends(WorldFields world)
@cython.locals(n=Py_ssize_t, message=wire.MessageWriter, unit=wire.MessageWriter, i=Py_ssize_t, is_here=bint, own=bint)
cdef _encode(object units)
cdef int _put_known(wire.MessageWriter unit, _View view, Py_ssize_t i, bint is_here) except -1
@cython.locals(row=int64_t, contents=int64_t)
cdef int _put_vitals(wire.MessageWriter unit, _View view, Py_ssize_t i) except -1
@cython.locals(slot=int64_t, row=int64_t, fixed=bint, levels=int64_t, powered=bint)
cdef int _put_standing(wire.MessageWriter unit, _View view, Py_ssize_t i) except -1
cdef int _put_orders(wire.MessageWriter unit, _View view, int64_t slot) except -1
@cython.locals(kind=int64_t, target=int64_t, aimed=bint, tag=int64_t, progress=double, x=double, y=double)
cdef int _put_only_order(wire.MessageWriter unit, _View view, int64_t slot) except -1
@cython.locals(begun=double, end=double, progress=double)
cdef double _progress(Columns c, int64_t slot, int64_t loop) noexcept
cdef int _put_order(wire.MessageWriter unit, _View view, uint32_t ability, int64_t target, bint aimed, double x, double y,
                    double progress) except -1
@cython.locals(taken=int64_t, inside=int64_t)
cdef int _put_load(wire.MessageWriter unit, _View view, int64_t slot, int64_t row) except -1
cdef int _put_passenger(wire.MessageWriter unit, _View view, int64_t slot) except -1
@cython.locals(workers=int64_t, ideal=int64_t)
cdef int _put_service(wire.MessageWriter unit, _View view, int64_t slot, int64_t row) except -1
cdef int _put_time_left(wire.MessageWriter unit, _View view, int64_t slot) except -1
cdef int _put_rallies(wire.MessageWriter unit, _View view, int64_t slot) except -1
