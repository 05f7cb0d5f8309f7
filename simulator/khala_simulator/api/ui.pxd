cimport cython
from libc.stdint cimport int64_t

from khala_simulator.api cimport fields, wire
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields

cdef int64_t SELF
cdef int64_t NEUTRAL
cdef int64_t ENEMY


@cython.final
cdef class _Infos:
    cdef Columns c
    cdef int64_t player
    cdef wire.MessageWriter info
    cdef tuple tables
    cdef int64_t type_count
    cdef int64_t* type_id
    cdef double* life_max
    cdef double* shields_max
    cdef double* energy_max
    @cython.locals(owner=int64_t, at=int64_t, life=int64_t, shields=int64_t, energy=int64_t, life_max=int64_t,
                   shields_max=int64_t, energy_max=int64_t)
    cdef int write(self, int64_t slot) except -1


@cython.locals(infos=_Infos, message=wire.MessageWriter, slot=int64_t)
cdef _encode_multi(WorldFields world, object types, list slots, int64_t player)
@cython.locals(infos=_Infos)
cdef _unit(WorldFields world, object types, int64_t slot, int64_t player)
