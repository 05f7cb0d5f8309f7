"""Buffs, compiled: whether any is due or over; `systems.buffs` has the rules."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.compiled.numbers cimport count

from khala_simulator.systems import buffs as rules
from khala_simulator.world import active_buffs

cnp.import_array()

cdef packed struct Buff:
    int64_t slot
    int64_t kind
    int64_t source
    int64_t owner
    int64_t begun
    double end
    double due
    int64_t stacks

if active_buffs.ROW.itemsize != sizeof(Buff) or active_buffs.ROW.fields["due"][1] != 6 * sizeof(double):
    raise ImportError("compiled/buffs.pyx does not fit world/active_buffs.py: declare the same fields, and build again")


def run_out(world):
    """Run the rules of buffs that are due, and remove those whose time is over."""
    cdef object rows = world.buffs.rows
    cdef Buff* buffs = <Buff*>cnp.PyArray_DATA(<cnp.ndarray>rows)
    cdef double loop = world.loop
    cdef Py_ssize_t i
    for i in range(count(rows)):
        if buffs[i].due <= loop or buffs[i].end <= loop:
            rules.run_out(world)
            return
