cimport cython
from libc cimport math
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport boolean
from khala_simulator.world.fields cimport WorldFields


@cython.final
cdef class Census:
    cdef readonly bint turrets
    cdef readonly bint beams
    cdef readonly bint rolling_guns
    cdef readonly bint guns_walking
    cdef readonly bint drifting_flyers
    cdef readonly bint brakers
    cdef readonly bint weapons_with_filters


cpdef Census census(WorldFields world)
