cimport cython
from libc.stdint cimport int64_t

from khala_simulator.combat cimport targets, weapon_choice
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns

cdef int64_t NOBODY


@cython.locals(c=Columns, row=int64_t, at=int64_t, kinds=list)
cpdef body_traits(object world, int64_t slot)
cdef _rearm(object world, int64_t slot, int64_t target)
@cython.locals(c=Columns, carrier=int64_t)
cdef _shelter(object world, int64_t slot)
@cython.locals(c=Columns, walking=double, still=double, walking_deg=double, still_deg=double)
cdef _turning(object world, int64_t slot, object unit)
cdef double _braking(object unit) except? -1.0
cpdef list kinds_on(object world, int64_t slot)
@cython.locals(c=Columns)
cdef _plain(object world, int64_t slot)
