cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields

cdef double SKIN
cdef double OVERLAP_ALLOWED
cdef Py_ssize_t FEW
cdef double FAR


@cython.final
cdef class Crowd:
    cdef Py_ssize_t count
    cdef Point* before
    cdef Point* after
    cdef Point* start
    cdef Point* force
    cdef double* enemy
    cdef double* friend
    cdef Py_ssize_t pairs
    cdef int64_t* first
    cdef int64_t* second
    cdef double* apart
    cdef double* share
    cdef double* rest
    cdef Point* offset
    cdef double* distance
    cdef double* push
    cdef int64_t* chosen
    cdef double closest
    cdef bint by_slots

    cdef Py_ssize_t _body_room
    cdef Py_ssize_t _pair_room
    cdef Py_ssize_t _slot_room
    cdef tuple _body_arrays  # these keep the memory alive
    cdef tuple _pair_arrays
    cdef object _place_array
    cdef int64_t* _body
    cdef Point* _at
    cdef double* _along
    cdef double* _separation
    cdef int64_t* _layers
    cdef int64_t* _close
    cdef int64_t* _ranked
    cdef Py_ssize_t _last
    cdef int64_t* _place

    cdef reserve(self, Py_ssize_t count, Py_ssize_t slots)
    cdef _reserve_bodies(self, Py_ssize_t room)
    cdef _reserve_pairs(self, Py_ssize_t room)
    @cython.locals(bodies=Py_ssize_t, i=Py_ssize_t, k=Py_ssize_t, end=Py_ssize_t, widest=double, touch=bint)
    cdef bint find_pairs(self, Columns c, int64_t* slots) except -1
    @cython.locals(across=bint, k=Py_ssize_t, j=Py_ssize_t)
    cdef void _rank(self, int64_t* slots, Py_ssize_t bodies) noexcept
    @cython.locals(i=Py_ssize_t, k=Py_ssize_t, known=Py_ssize_t)
    cdef void _recall(self, int64_t* slots, Py_ssize_t bodies) noexcept
    @cython.locals(k=Py_ssize_t, low_x=double, high_x=double, low_y=double, high_y=double)
    cdef bint _spreads_upwards(self, Py_ssize_t bodies) noexcept
    @cython.locals(near=Py_ssize_t, n=Py_ssize_t, j=Py_ssize_t, touch=bint, inside=double)
    cdef bint _meet(self, Py_ssize_t k, Py_ssize_t end) except -1


cdef Crowd crowd_of(WorldFields world)
