cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport tags
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport boolean
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t X
cdef int64_t Y
cdef int64_t LIFE
cdef int64_t LIFE_MAX
cdef int64_t SHIELDS
cdef int64_t SHIELDS_MAX
cdef int64_t ENERGY
cdef int64_t COOLDOWN


@cython.final
cdef class Reader:
    cdef tuple arrays
    cdef Columns c
    cdef int64_t types
    cdef double* life_max
    cdef double* shields_max
    cdef boolean* armed

    @cython.locals(slot=int64_t)
    cdef int64_t find(self, int64_t tag) noexcept
    @cython.locals(c=Columns, at=int64_t, cooldown=double)
    cdef void read(self, int64_t slot, double* numbers, int64_t n, int64_t i) noexcept


@cython.locals(reader=Reader, n=int64_t, i=int64_t, slot=int64_t)
cpdef look(WorldFields world, object types, object tags, object there, object numbers)
