"""Avoidance, compiled; `systems.avoidance` has the rules."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns, Point, boolean, columns_of
from khala_simulator.compiled.numbers cimport count, floats, ints, length, most, new_floats, new_ints, new_points
from khala_simulator.compiled.surfaces cimport Grid, cell_at, grid_of

from khala_simulator.compiled.flow import Flow
from khala_simulator.systems import avoidance as rules
from khala_simulator.systems import flanking
from khala_simulator.tables.mechanics import MECHANICS

cnp.import_array()

cdef enum:
    SIDE = 6  # headings to one side
    FAN = 12  # and to both
cdef int64_t NOBODY = -1
cdef int64_t AIR = rules.AIR
cdef int64_t LED = flanking.LED
cdef double SEEN_AHEAD = rules.SEEN_AHEAD
cdef double TOLERANCE = rules.TOLERANCE
cdef double LOOK_SQUARED = MECHANICS.detour_look**2
cdef int64_t DETOUR_PERIOD = MECHANICS.detour_period
cdef int64_t DETOUR_LOOPS = MECHANICS.detour_loops
cdef int64_t FLANK_PERIOD = MECHANICS.flank_period
cdef double[FAN] FAN_COS = rules.FAN_COS
cdef double[FAN] FAN_SIN = rules.FAN_SIN


def find_headings(world):
    """Write ``aside`` of walkers that have to go around others; it is checked every few loops."""
    cdef int64_t loop = world.loop
    if loop % DETOUR_PERIOD:
        return
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t n = world.top, slot, i, due = 0
    cdef cnp.ndarray turning = None
    for slot in range(n):
        if c.detour[slot] == 0:
            continue
        if c.detour_end[slot] <= loop or not c.wants[slot]:
            c.detour[slot] = 0
            c.aside[slot].x = c.aside[slot].y = 0.0
            continue
        if turning is None:
            turning = new_ints(n)
        ints(turning)[due] = slot
        due += 1
    if not due:
        return
    # in the middle of the usual step of 8 loops: who gets a new order at every step is led for the rest of it
    if (loop - DETOUR_PERIOD) % FLANK_PERIOD == 0:
        for i in range(due):
            slot = ints(turning)[i]
            if flows(c, slot):
                c.detour[slot] = 1 if c.detour[slot] > 0 else -1
        flanking.lead(world, turning[:due], Flow)
    look(world, c, ints(turning), due)


cdef inline bint flows(Columns c, int64_t slot) noexcept:
    """Return whether a walker follows a flow."""
    return c.detour[slot] == LED or c.detour[slot] == -LED


# the side -------------------------------------------------------------------------------------------------------------


def begin(world, cnp.ndarray slots, cnp.ndarray shift):
    """Make blocked walkers look for a way around, first on the side where fewer stand or to which ``shift`` pushed."""
    cdef Columns c = columns_of(world)
    cdef Point* shifts = <Point*>floats(shift)
    cdef Point way
    cdef Py_ssize_t i, bodies = -1
    cdef int64_t slot, end = world.loop + DETOUR_LOOPS
    cdef cnp.ndarray places = None, room = None
    cdef double beside, turn
    for i in range(count(slots)):
        slot = ints(slots)[i]
        c.detour_end[slot] = end
        if c.detour[slot] != 0:
            continue
        if bodies < 0:
            places = new_points(count(world.live))
            bodies = standing(world, c, <Point*>floats(places))
            room = new_floats(bodies)
        way = c.intended[slot]
        beside = to_the_left(c.pos[slot], way, <Point*>floats(places), bodies, floats(room))
        turn = way.x * shifts[i].y - way.y * shifts[i].x if beside == 0.0 else -beside
        c.detour[slot] = 1 if turn >= 0.0 else -1


cdef Py_ssize_t standing(world, Columns c, Point* places) except -1:
    """Write where the bodies are that do not walk; return how many."""
    cdef cnp.ndarray live = world.live
    cdef Py_ssize_t i, bodies = 0
    cdef int64_t slot
    for i in range(count(live)):
        slot = ints(live)[i]
        if not c.wants[slot] and c.layer[slot] != AIR:
            places[bodies] = c.pos[slot]
            bodies += 1
    return bodies


cdef double to_the_left(Point at, Point way, Point* places, Py_ssize_t bodies, double* terms) noexcept:
    """Return how far to the left of a way the bodies stand that are near and ahead, summed up."""
    cdef Py_ssize_t i
    cdef double x, y
    for i in range(bodies):
        x, y = places[i].x - at.x, places[i].y - at.y
        terms[i] = 0.0
        if x * x + y * y < LOOK_SQUARED and x * way.x + y * way.y > 0.0:
            terms[i] = y * way.x - x * way.y
    return total(terms, bodies)


cdef double total(double* terms, Py_ssize_t n) noexcept:
    """Return a sum in the order of `numpy.add.reduce` along an axis of contiguous numbers: pairwise."""
    cdef double[8] sums
    cdef double result = 0.0
    cdef Py_ssize_t i, j, half
    if n < 8:
        for i in range(n):
            result += terms[i]
        return result
    if n > 128:
        half = n // 2 - n // 2 % 8
        return total(terms, half) + total(terms + half, n - half)
    for j in range(8):
        sums[j] = terms[j]
    for i in range(1, n // 8):
        for j in range(8):
            sums[j] += terms[8 * i + j]
    result = ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]))
    for i in range(n - n % 8, n):
        result += terms[i]
    return result


# the heading ----------------------------------------------------------------------------------------------------------


cdef look(world, Columns c, int64_t* slots, Py_ssize_t n):
    """Choose the heading of every walker that follows no flow: the free one that turns it least."""
    cdef cnp.ndarray live = world.live
    cdef Py_ssize_t i, first
    cdef int64_t slot
    cdef Point way, start
    cdef Point[FAN] headings
    cdef boolean[FAN] free
    cdef double size
    cdef Grid grid
    ground = world.ground
    for i in range(n):
        slot = slots[i]
        if flows(c, slot):
            continue
        start = c.pos[slot]
        way.x, way.y = c.nav_point[slot].x - start.x, c.nav_point[slot].y - start.y
        size = most(length(way.x, way.y), 1e-12)
        way.x /= size
        way.y /= size
        fan(way, c.detour[slot], headings)
        for first in range(FAN):
            free[first] = True
        if c.layer[slot] != AIR:
            grid = grid_of(ground, c.layer[slot])
            for first in range(FAN):
                free[first] = grid.flat[cell_at(
                    grid, start.x + headings[first].x * SEEN_AHEAD, start.y + headings[first].y * SEEN_AHEAD
                )]
        keep_off(c, ints(live), count(live), slot, way, headings, free)
        first = 0
        while first < FAN and not free[first]:
            first += 1
        # an army on its way to a fight keeps to its sides: who turned back would meet those that follow
        if SIDE < first < FAN and c.target[slot] != NOBODY:
            c.detour[slot] = -c.detour[slot]
        if 0 < first < FAN:
            c.aside[slot] = headings[first]
        else:
            c.aside[slot].x = c.aside[slot].y = 0.0


cdef void fan(Point way, double side, Point* headings) noexcept:
    """Write headings turned further and further to a side (1 is left), then to the other side."""
    cdef int i
    cdef double sine
    for i in range(FAN):
        sine = FAN_SIN[i] * side
        headings[i].x = way.x * FAN_COS[i] - way.y * sine
        headings[i].y = way.y * FAN_COS[i] + way.x * sine


cdef void keep_off(
    Columns c, int64_t* live, Py_ssize_t n, int64_t slot, Point way, Point* headings, boolean* free
) noexcept:
    """Rule out the headings that lead into a body that stands or comes within ``SEEN_AHEAD``."""
    cdef Py_ssize_t i, j
    cdef int64_t other
    cdef double x, y, apart, seen, along, across, reach
    cdef Point start = c.pos[slot]
    for i in range(n):
        other = live[i]
        x, y = c.pos[other].x - start.x, c.pos[other].y - start.y
        apart = c.separation[slot] + c.separation[other] - TOLERANCE
        seen = apart + SEEN_AHEAD
        if (
            x * x + y * y >= seen * seen
            or c.walled[other]
            or c.layer_bits[slot] & c.layer_bits[other] == 0
            or other == slot
            or other == c.target[slot]
            or way.x * c.intended[other].x + way.y * c.intended[other].y > 0.0
        ):
            continue
        for j in range(FAN):
            along = headings[j].x * x + headings[j].y * y
            across = headings[j].x * y - headings[j].y * x
            reach = most(along - SEEN_AHEAD, 0.0)
            if along > 0.0 and across * across + reach * reach < apart * apart:
                free[j] = False
