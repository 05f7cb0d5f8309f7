"""When a walker whose way is blocked by others is near enough to its goal, as `movement.arrival` has it."""
from libc.stdint cimport int64_t
from libc.stdlib cimport free, malloc

from khala_simulator.native.columns cimport Columns
from khala_simulator.compiled.sums cimport pairwise

from khala_simulator.movement import arrival as rules
from khala_simulator.tables.mechanics import MECHANICS

cdef int64_t BLOCKED_LOOPS = rules.BLOCKED_LOOPS
cdef double CROWD_NEAR = MECHANICS.crowd_near
cdef double CROWD_SHARE = MECHANICS.crowd_share
cdef int64_t CROWD_PATIENCE = MECHANICS.crowd_patience
cdef int64_t CROWD_STALL = MECHANICS.crowd_stall
cdef double ROUNDING = 1e-9  # more than the order of a sum makes of it, relatively


cdef bint packed(Columns c, Crowd* crowd, int64_t slot) except -1:
    """Return whether a walker has come as near to its goal as the crowd allows."""
    cdef double x = c.nav_goal[slot].x - c.pos[slot].x, y = c.nav_goal[slot].y - c.pos[slot].y
    cdef double squared = x * x + y * y, near = c.separation[slot] + CROWD_NEAR
    if c.blocked[slot] >= CROWD_PATIENCE and squared < near * near:
        return True
    if crowd.area < 0.0:
        crowd.area = area_of(c, crowd, -1, 0.0)
    if not squared * CROWD_SHARE <= crowd.area:  # no walker is packed farther out than this
        return False
    if c.nav_loop[slot] > 0 and crowd.loop - c.nav_best_loop[slot] > CROWD_STALL:
        return True  # the way has been checked since the order
    return c.blocked[slot] >= BLOCKED_LOOPS and fills(c, crowd, slot, squared)


cdef bint fills(Columns c, Crowd* crowd, int64_t slot, double squared) except -1:
    """Return whether friends fill the ground between a walker and its goal."""
    cdef double area = 0.0, wanted = CROWD_SHARE * squared
    cdef Py_ssize_t i
    cdef int64_t other
    for i in range(crowd.units):
        other = crowd.live[i]
        if is_inside(c, slot, other, squared):
            area += c.separation[other] * c.separation[other]
            if area > wanted * (1.0 + ROUNDING):
                return True
    return area >= wanted * (1.0 - ROUNDING) and area_of(c, crowd, slot, squared) >= wanted


cdef bint is_inside(Columns c, int64_t slot, int64_t other, double squared) noexcept:
    """Return whether another body is a friend in the way that is nearer to a walker's goal."""
    cdef double x = c.pos[other].x - c.nav_goal[slot].x, y = c.pos[other].y - c.nav_goal[slot].y
    return (
        x * x + y * y < squared
        and c.owner[other] == c.owner[slot]
        and c.layer_bits[other] & c.layer_bits[slot] != 0
        and other != slot
    )


cdef double area_of(Columns c, Crowd* crowd, int64_t slot, double squared) except -1.0:
    """Return the area of all bodies, or of those between a walker and its goal, summed as numpy does."""
    cdef double* areas = <double*>malloc(crowd.units * sizeof(double) + 1)
    cdef double area
    cdef Py_ssize_t i
    cdef int64_t other
    if areas == NULL:
        raise MemoryError
    for i in range(crowd.units):
        other = crowd.live[i]
        areas[i] = c.separation[other] * c.separation[other]
        if slot >= 0 and not is_inside(c, slot, other, squared):
            areas[i] = 0.0
    area = pairwise(areas, crowd.units)
    free(areas)
    return area
