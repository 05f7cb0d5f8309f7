cimport cython
from libc.stdint cimport int16_t, int64_t, uint8_t, uint16_t

from khala_simulator.combat cimport fog
from khala_simulator.native cimport columns, memory
from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.world.fields cimport WorldFields

cdef int64_t NUMBERS
cdef int64_t AIR
cdef uint8_t SEEN_BEFORE
cdef uint8_t VISIBLE
cdef int64_t FROM_ABOVE
cdef int64_t VISION_PERIOD
cdef double HIGH_GROUND_STEP


@cython.final
cdef class Eyes:
    cdef object _cliffs
    cdef uint16_t* _cliff
    cdef Py_ssize_t _height
    cdef Py_ssize_t _width
    cdef object _counts
    cdef int16_t* _count
    cdef object _units
    cdef set _lights
    @cython.locals(cells=Py_ssize_t, cell=Py_ssize_t)
    cdef light(self, WorldFields world)
    @cython.locals(top=Py_ssize_t, i=Py_ssize_t, slot=Py_ssize_t, at=Py_ssize_t)
    cdef _count_units(self, WorldFields world, Columns c)
    @cython.locals(at=Py_ssize_t, level=int64_t, x=int64_t, y=int64_t)
    cdef void _write(self, Columns c, int64_t slot, double* eyes) noexcept
    cdef _count_lights(self, WorldFields world)
    @cython.locals(owner=int64_t, x=int64_t, y=int64_t, below=int64_t, half=int64_t, first=Py_ssize_t, row=int64_t,
                   column=int64_t, cell=int64_t)
    cdef _watch(self, double* eyes, Py_ssize_t at, int16_t sign)


@cython.locals(changed=bint, fogged=bint, due=bint, loop=int64_t, player=int64_t)
cpdef look(WorldFields world)
@cython.locals(players=Py_ssize_t, height=Py_ssize_t, width=Py_ssize_t, fogged=bint, hidden=list, player=Py_ssize_t,
               slot=int64_t, i=Py_ssize_t, cell=Py_ssize_t)
cdef _see_units(WorldFields world, Columns c)
@cython.locals(player=int64_t, i=Py_ssize_t, slot=int64_t)
cdef _hide(WorldFields world, Columns c, list hidden)
cdef _reveal(WorldFields world)
@cython.locals(x=int64_t, y=int64_t)
cdef Py_ssize_t cell_at(Point point, Py_ssize_t width, Py_ssize_t height) noexcept
@cython.locals(differ=bint)
cdef bint _differ(double* eyes, double* others, Py_ssize_t at) noexcept
cdef Eyes _eyes_of(WorldFields world)
