"""Avoidance, compiled; `systems.avoidance` has the rules."""
cimport cython
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.native.memory cimport Point
from khala_simulator.compiled.flanking cimport lead
from khala_simulator.compiled.numbers cimport count, floats, ints, length, most, new_floats, new_ints, new_points
from khala_simulator.compiled.sums cimport pairwise
from khala_simulator.compiled.surfaces cimport Grid, cell_at, grid_of

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

cdef enum:
    STRIPES = 256

cdef struct Body:
    Point at
    Point step
    double separation
    int64_t bits  # layers it collides in
    int64_t slot

cdef struct Obstacle:
    double x  # from the walker
    double y
    double apart  # distance to keep


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
        lead(world, c)
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
    return pairwise(terms, bodies)


# the heading ----------------------------------------------------------------------------------------------------------


cdef look(world, Columns c, int64_t* slots, Py_ssize_t n):
    """Choose the heading of every walker that follows no flow: the free one that turns it least."""
    cdef Crowd crowd = Crowd(world)
    cdef Grid grid = None
    cdef Py_ssize_t i, turn
    cdef int64_t slot, last = -1
    cdef Point way, heading
    cdef double size
    ground = world.ground
    for i in range(n):
        slot = slots[i]
        if flows(c, slot):
            continue
        way.x, way.y = c.nav_point[slot].x - c.pos[slot].x, c.nav_point[slot].y - c.pos[slot].y
        size = most(length(way.x, way.y), 1e-12)
        way.x /= size
        way.y /= size
        if c.layer[slot] != AIR and c.layer[slot] != last:
            grid, last = grid_of(ground, c.layer[slot]), c.layer[slot]
        crowd.look_around(c, slot, way)
        for turn in range(FAN):
            heading = heading_of(way, turn, c.detour[slot])
            if (c.layer[slot] == AIR or on_ground(grid, c.pos[slot], heading)) and crowd.lets_pass(heading):
                break
        else:
            turn = FAN
        # an army on its way to a fight keeps to its sides: who turned back would meet those that follow
        if SIDE < turn < FAN and c.target[slot] != NOBODY:
            c.detour[slot] = -c.detour[slot]
        if 0 < turn < FAN:
            c.aside[slot] = heading
        else:
            c.aside[slot].x = c.aside[slot].y = 0.0


cdef Point heading_of(Point way, Py_ssize_t turn, double side) noexcept:
    """Return one of the headings that turn further and further to a side (1 is left), then to the other side."""
    cdef double sine = FAN_SIN[turn] * side
    cdef Point heading
    heading.x = way.x * FAN_COS[turn] - way.y * sine
    heading.y = way.y * FAN_COS[turn] + way.x * sine
    return heading


cdef bint on_ground(Grid grid, Point start, Point heading) noexcept:
    """Return whether a heading leads to a free cell."""
    return grid.flat[cell_at(grid, start.x + heading.x * SEEN_AHEAD, start.y + heading.y * SEEN_AHEAD)]


cdef inline int64_t stripe(double x) noexcept:
    """Return the number of the stripe of the map, one cell wide, in which a point is counted."""
    return 0 if x < 0.0 else STRIPES - 1 if x >= STRIPES else <int64_t>x


@cython.final
cdef class Crowd:
    """The bodies that may be in somebody's way, stripe by stripe of the map."""

    cdef tuple arrays  # keeps the memory alive
    cdef Body* bodies
    cdef Obstacle* near
    cdef Py_ssize_t many  # near a walker
    cdef Py_ssize_t[STRIPES + 1] begin  # of each stripe
    cdef double widest

    def __cinit__(self, world):
        cdef Columns c = columns_of(world)
        cdef cnp.ndarray live = world.live
        cdef Py_ssize_t i
        cdef int64_t slot
        cdef Body* body
        self.arrays = (
            new_floats(count(live) * <Py_ssize_t>(sizeof(Body) // sizeof(double))),
            new_floats(count(live) * <Py_ssize_t>(sizeof(Obstacle) // sizeof(double))),
        )
        self.bodies, self.near = <Body*>floats(self.arrays[0]), <Obstacle*>floats(self.arrays[1])
        for i in range(count(live)):
            if in_the_way(c, ints(live)[i]):
                self.begin[stripe(c.pos[ints(live)[i]].x)] += 1
        for i in range(1, STRIPES + 1):
            self.begin[i] += self.begin[i - 1]
        for i in range(count(live)):
            slot = ints(live)[i]
            if in_the_way(c, slot):
                self.begin[stripe(c.pos[slot].x)] -= 1
                body = &self.bodies[self.begin[stripe(c.pos[slot].x)]]
                body.at, body.step, body.separation = c.pos[slot], c.intended[slot], c.separation[slot]
                body.bits, body.slot = c.layer_bits[slot], slot
                self.widest = most(self.widest, body.separation)

    cdef void look_around(self, Columns c, int64_t slot, Point way) noexcept:
        """Find the bodies that stand near a walker or come towards it."""
        cdef double x, y, apart, seen, separation = c.separation[slot]
        cdef double farthest = separation + self.widest + SEEN_AHEAD
        cdef Point start = c.pos[slot]
        cdef Py_ssize_t i
        cdef Body* body
        self.many = 0
        for i in range(self.begin[stripe(start.x - farthest)], self.begin[stripe(start.x + farthest) + 1]):
            body = &self.bodies[i]
            x, y = body.at.x - start.x, body.at.y - start.y
            apart = separation + body.separation - TOLERANCE
            seen = apart + SEEN_AHEAD
            if (
                x * x + y * y < seen * seen
                and c.layer_bits[slot] & body.bits != 0
                and body.slot != slot
                and body.slot != c.target[slot]
                and way.x * body.step.x + way.y * body.step.y <= 0.0
            ):
                self.near[self.many].x, self.near[self.many].y, self.near[self.many].apart = x, y, apart
                self.many += 1

    cdef bint lets_pass(self, Point heading) noexcept:
        """Return whether a heading leads into none of these within ``SEEN_AHEAD``."""
        cdef double along, across, reach
        cdef Obstacle* near
        cdef Py_ssize_t i
        for i in range(self.many):
            near = &self.near[i]
            along = heading.x * near.x + heading.y * near.y
            across = heading.x * near.y - heading.y * near.x
            reach = most(along - SEEN_AHEAD, 0.0)
            if along > 0.0 and across * across + reach * reach < near.apart * near.apart:
                return False
        return True


cdef inline bint in_the_way(Columns c, int64_t slot) noexcept:
    """Return whether a unit is a body to go round; what stands on a footprint is a wall."""
    return c.layer_bits[slot] != 0 and not c.walled[slot]
