"""Construction, compiled: in most loops nothing is being built; `systems.construction` has the rules."""

from khala_simulator.native.columns cimport Columns, columns_of

from khala_simulator.systems import construction as rules


def run(world):
    """Advance everything that is being built by one loop."""
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t slot, n = world.top
    for slot in range(n):
        if c.build_progress[slot] < 1.0:
            rules.run(world)
            return
