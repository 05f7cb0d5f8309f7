"""Contacts, compiled: which bodies touch or nearly do; `movement.contacts` has the rules."""
cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point

cdef struct Pair:
    int one  # indices into the living slots
    int other
    double apart  # distance to keep
    double share  # part of an overlap by which the first gives way
    double rest  # and the other
    double x  # from the other to the first
    double y
    double depth  # of their overlap
    double push  # that part of the offset

cdef struct Place:
    double along  # on the axis on which the crowd spreads wider
    double across
    double separation
    int bits  # layers it collides in
    int body  # index into the living slots

@cython.final
cdef class Crowd:
    """The bodies of one world, and room for what is measured between them."""

    cdef Py_ssize_t count  # of living units
    cdef Py_ssize_t room  # for bodies
    cdef Point* before  # (count,) positions
    cdef Point* after
    cdef Point* start
    cdef Point* force
    cdef double* enemy  # (count,) how easily each is pushed by an enemy
    cdef double* friend  # and by a friend
    cdef Place* places  # those that can meet others
    cdef Place* ranked  # the same, sorted
    cdef Py_ssize_t* close  # which of them are near one
    cdef int64_t* sorted  # slots in the order in which they were found last
    cdef Py_ssize_t known  # how many of them
    cdef int64_t* index  # (slots,) where each is among the places, -1 for most
    cdef Py_ssize_t slots
    cdef Pair* pairs
    cdef Py_ssize_t many  # pairs found
    cdef Py_ssize_t pair_room
    cdef Py_ssize_t* chosen  # (pair_room,) numbers of pairs
    cdef bint by_slots  # whether the pairs are in the order of slots, both ways round
    cdef double closest  # the least distance between two of a pair, squared

    cdef int reserve(self, Py_ssize_t count, Py_ssize_t slots) except -1
    cdef int all_pairs(self, Py_ssize_t bodies) except -1
    cdef int neighbours(self, int64_t* slots, Py_ssize_t bodies) except -1
    cdef int note(self, Place* one, Place* other) except -1
    cdef void rank(self, int64_t* slots, Py_ssize_t bodies) noexcept
    cdef int near(self, Columns c, int64_t* slots) except -1

cdef Crowd crowd_of(object world)
