"""What a hit takes from which unit, as `combat.damage` has it."""
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns
from khala_simulator.compiled.shots cimport Shot

cdef struct Affects:
    bint allies
    bint neutral
    bint only_structures
    bint no_structures
    bint not_self
    bint not_target
    int64_t planes  # of which the unit has to be on one

cdef Affects affects_of(object record)
cdef bint touches(Columns c, Affects* affects, Shot* shot, int64_t slot) noexcept
cdef hit_with(object world, Shot* shot)
cdef hit_target(object world, Shot* shot)
