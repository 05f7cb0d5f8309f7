cimport cython
from libc.stdint cimport int64_t

from khala_simulator.native cimport columns
from khala_simulator.native.columns cimport Columns
from khala_simulator.world.fields cimport WorldFields


@cython.locals(shields=bint, life=bint, energy=bint, loop=int64_t, slot=Py_ssize_t)
cpdef regenerate(WorldFields world)
cdef void _regain_shields(Columns c, int64_t slot) noexcept
cdef void _regain_life(Columns c, int64_t slot) noexcept
cdef void _regain_energy(Columns c, int64_t slot) noexcept
