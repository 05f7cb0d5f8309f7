"""A unit begins and ends a fight, as `combat.targets` has it."""
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns
from khala_simulator.compiled.numbers cimport length

cdef engage(object world, Columns c, int64_t slot, int64_t target)
cdef void drop_attack(Columns c, int64_t slot) noexcept
cdef void disengage(Columns c, int64_t slot) noexcept

cdef inline bint inside_zone(Columns c, int64_t slot, int64_t target) noexcept:
    """Return whether a target touches the only circle in which a unit fires; most units fire anywhere."""
    cdef double x = c.pos[target].x - c.zone[slot].x, y = c.pos[target].y - c.zone[slot].y
    return length(x, y) <= c.zone_radius[slot] + c.radius[target] or c.zone_radius[slot] <= 0.0
