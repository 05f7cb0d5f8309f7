"""What a foe is worth to a unit, as `systems.acquire` has it."""
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns

cdef bint is_foe(Columns c, int64_t player, int64_t slot) noexcept
cdef double rank_of(Columns c, int64_t seeker, int64_t foe) noexcept
