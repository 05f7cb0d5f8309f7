cimport cython
from libc.stdint cimport int64_t, uint8_t, uint32_t, uint64_t

from khala_simulator.native cimport memory

cdef int64_t _MOST
cdef uint32_t _X
cdef uint32_t _Y
cdef uint32_t _Z
cdef int64_t _POINT_SIZE


@cython.final
cdef class MessageWriter:
    cdef object _array
    cdef uint8_t* _bytes
    cdef Py_ssize_t _room
    cdef readonly Py_ssize_t size
    cpdef void clear(self) noexcept
    cpdef content(self)
    cpdef int put_number(self, uint32_t key, uint64_t number) except -1
    cpdef int put_float(self, uint32_t key, double number) except -1
    cpdef int put_point(self, uint32_t key, double x, double y, double z) except -1
    cpdef int put_message(self, uint32_t key, MessageWriter message) except -1
    cdef void _put_varint(self, uint64_t number) noexcept
    cdef int _reserve(self, Py_ssize_t more) except -1
    cdef _grow(self, Py_ssize_t room)
