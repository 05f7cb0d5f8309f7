cimport cython
from libc.stdint cimport int64_t

from khala_simulator.api cimport vitals
from khala_simulator.api.vitals cimport Reader
from khala_simulator.native cimport memory
from khala_simulator.native.memory cimport boolean
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NOBODY
cdef int64_t LIFE
cdef int64_t SHIELDS


@cython.final
cdef class Fighters:
    cdef readonly int64_t agents
    cdef readonly int64_t count
    cdef readonly int64_t bits
    cdef readonly object tag
    cdef readonly object type_id
    cdef readonly object numbers
    cdef readonly object types
    cdef readonly object most_shields
    cdef readonly object most_charge
    cdef readonly object medivac
    cdef readonly object alive
    cdef readonly object died
    cdef readonly object life
    cdef readonly object before
    cdef int64_t* tags
    cdef double* cells
    cdef boolean* lives
    cdef boolean* deaths
    cdef double* health
    cdef double* past
    cdef double* codes
    cdef double* shields_by
    cdef double* charge_by
    cdef boolean* heals

    cdef _bind(self)
    @cython.locals(reader=Reader, n=int64_t, i=int64_t, slot=int64_t, there=bint)
    cpdef look(self, WorldFields world, object types)
    @cython.locals(damage=double, kills=double, deaths=double)
    cpdef double reward(self, double death_value, double negative_scale, bint only_positive)
    @cython.locals(total=double, i=int64_t)
    cdef double _damage(self, int64_t first, int64_t last, double weight) noexcept
    @cython.locals(total=double, i=int64_t)
    cdef double _deaths(self, int64_t first, int64_t last, double value, double weight) noexcept
    @cython.locals(heals=bint, agents=int64_t, enemies=int64_t)
    cpdef int64_t ending(self)
    @cython.locals(i=int64_t)
    cpdef bint heal(self)
    @cython.locals(i=int64_t, last=int64_t)
    cpdef bint one_medivac(self)
    @cython.locals(living=int64_t, i=int64_t)
    cdef int64_t _living(self, int64_t first, int64_t last) noexcept
    @cython.locals(living=int64_t, i=int64_t)
    cdef int64_t _living_fighters(self) noexcept
