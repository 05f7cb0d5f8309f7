"""Death, compiled: whether anyone died; `systems.death` has the rules."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.compiled.numbers cimport count, ints

from khala_simulator.systems import death as rules

cnp.import_array()


def bury(world):
    """Remove every unit without life, in the order of slots, and those that their deaths kill in turn."""
    cdef Columns c = columns_of(world)
    cdef object live = world.live
    cdef int64_t* slots = ints(live)
    cdef Py_ssize_t i
    for i in range(count(live)):
        if c.life[slots[i]] <= 0.0:
            rules.bury(world)
            return
