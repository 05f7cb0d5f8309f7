"""What a hit takes from which unit, as `combat.damage` has it."""
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns
from khala_simulator.compiled.shots cimport Shot
from khala_simulator.compiled.tables cimport Affects

cdef bint touches(Columns c, Affects* affects, Shot* shot, int64_t slot) noexcept
cdef hit_with(object world, Shot* shot)
cdef hit_target(object world, Shot* shot)
