"""Casts, compiled: in most loops nobody casts; `systems.casts` has the rules."""
from khala_simulator.native.columns cimport Columns, columns_of

from khala_simulator.systems import casts as rules


def carry_on(world):
    """Advance every cast by one loop, in the order of slots."""
    cdef Columns c
    cdef Py_ssize_t slot, n
    if not world.channelling:
        c, n = columns_of(world), world.top
        for slot in range(n):
            if c.casts[slot]:
                break
        else:
            return
    rules.carry_on(world)
