"""Engagement, compiled; `systems.engagement` has the rules and everything that is rare."""
cimport numpy as cnp
from libc.math cimport fabs
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.native.memory cimport boolean
from khala_simulator.compiled.numbers cimport floats, ints, least, length, most, new_ints
from khala_simulator.combat.targets cimport inside_zone

from khala_simulator.economy import harvesting
from khala_simulator.systems import engagement as rules
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.census import census

cnp.import_array()

cdef int64_t NOBODY = -1
cdef int64_t FOLLOW = rules.FOLLOW
cdef int64_t TO_RESOURCE = rules.TO_RESOURCE
cdef int64_t TO_HALL = rules.TO_HALL
cdef double EDGE_TOLERANCE = rules.EDGE_TOLERANCE
cdef double ON_TARGET = rules.ON_TARGET
cdef double ARMS_LENGTH = rules.ARMS_LENGTH
cdef double BESIDE_WALLS = rules.BESIDE_WALLS
cdef double FOLLOW_GAP = rules.FOLLOW_GAP
cdef double HARVEST_OVERLAP = rules.HARVEST_OVERLAP
cdef double CHASE_SLACK = MECHANICS.chase_slack
cdef double GUARD_SLACK_SQUARED = MECHANICS.guard_slack**2
cdef double HARVEST_GAP = MECHANICS.harvest_gap


def measure(world):
    """Measure the distance of every fight and write which units want to walk where."""
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t n = world.top, slot, fighting = 0
    cdef bint follows = False, approaches = False, goes_back = False, rolls, free
    for slot in range(n):
        fighting += c.target[slot] >= 0
        c.wants[slot] = c.walks[slot]
        c.goal[slot] = c.order_point[slot]
        c.stop_at[slot] = 0.0
        c.in_reach[slot] = False
        follows |= c.needs_target[slot]
        approaches |= c.casts[slot]
        goes_back |= c.returning[slot]
    cdef cnp.ndarray fighters = new_ints(fighting)
    cdef int64_t* slots = ints(fighters)
    world.fighters = fighters
    fighting = 0
    for slot in range(n):
        if c.target[slot] >= 0:
            slots[fighting] = slot
            fighting += 1
    if follows:
        follow(c, n)
    if approaches:
        rules.approach(world)
    if world.harvesting:
        haul(c, n, world)
    if goes_back:
        go_back(c, n)
    kinds = census(world)
    rolls = kinds.rolling_guns
    if fighting:
        close_in(world, c, kinds, slots, fighting)
    for slot in range(n):
        if c.wants[slot]:
            free = c.windup[slot] < 0.0 and c.backswing[slot] <= 0.0 or rolls and c.rolling[slot]
            c.wants[slot] = free and c.step_max[slot] > 0.0


cdef void follow(Columns c, Py_ssize_t n) noexcept:
    """Make units that follow another one walk until they are beside it."""
    cdef Py_ssize_t slot
    cdef int64_t leader
    cdef double stop_at
    for slot in range(n):
        leader = c.order_target[slot]
        if c.order_kind[slot] == FOLLOW and leader >= 0:
            stop_at = c.separation[slot] + c.separation[leader] + FOLLOW_GAP
            c.goal[slot] = c.pos[leader]
            c.stop_at[slot] = stop_at
            c.wants[slot] = (
                length(c.pos[leader].x - c.pos[slot].x, c.pos[leader].y - c.pos[slot].y) > stop_at + FOLLOW_GAP
            )


cdef haul(Columns c, Py_ssize_t n, world):
    """Make workers walk until they are at their resource or town hall."""
    cdef cnp.ndarray outlines = harvesting.outlines(world.catalog)  # (4, types)
    cdef Py_ssize_t types = cnp.PyArray_DIM(outlines, 1), slot
    cdef double* half_x = floats(outlines)
    cdef double* half_y = half_x + types
    cdef double* diagonal = half_y + types
    cdef double* radius = diagonal + types
    cdef int64_t place, kind
    cdef double dx, dy, distance, across, along, walls, stop_at
    for slot in range(n):
        place = c.order_target[slot]
        if place < 0 or (c.harvest[slot] != TO_RESOURCE and c.harvest[slot] != TO_HALL):
            continue
        dx = c.pos[place].x - c.pos[slot].x
        dy = c.pos[place].y - c.pos[slot].y
        distance = most(length(dx, dy), 1e-9)
        across, along = most(fabs(dx) / distance, 1e-9), most(fabs(dy) / distance, 1e-9)
        kind = c.type[place]
        walls = least(least(half_x[kind] / across, half_y[kind] / along), diagonal[kind] / (across + along))
        stop_at = most(walls + HARVEST_GAP, radius[kind]) + c.radius[slot]
        c.goal[slot] = c.pos[place]
        c.stop_at[slot] = stop_at - HARVEST_OVERLAP
        c.wants[slot] = dx * dx + dy * dy > stop_at * stop_at


cdef void go_back(Columns c, Py_ssize_t n) noexcept:
    """Send idle units back to where they stood before a fight; once there, they forget that place."""
    cdef Py_ssize_t slot
    cdef double dx, dy
    for slot in range(n):
        if c.returning[slot] and c.target[slot] == NOBODY:
            dx, dy = c.guard[slot].x - c.pos[slot].x, c.guard[slot].y - c.pos[slot].y
            c.returning[slot] = c.wants[slot] = dx * dx + dy * dy > GUARD_SLACK_SQUARED
            c.goal[slot] = c.guard[slot]


cdef close_in(world, Columns c, kinds, int64_t* slots, Py_ssize_t fighting):
    """Write the distances, goals and reach of the units that fight."""
    cdef bint beams = kinds.beams, rolling_guns = kinds.rolling_guns, guns_walking = kinds.guns_walking
    cdef bint hides = world.fog or world.hiding, zones = bool(world.area_effects)
    cdef Py_ssize_t i
    cdef int64_t slot, target
    cdef double dx, dy, distance, bodies, gap, reach
    cdef bint swings, beyond, near
    for i in range(fighting):
        slot = slots[i]
        target = c.target[slot]
        dx, dy = c.pos[target].x - c.pos[slot].x, c.pos[target].y - c.pos[slot].y
        distance = length(dx, dy)
        bodies = c.radius[slot] + c.radius[target]
        gap = distance - bodies
        if distance < ON_TARGET:
            dx, dy, distance = c.heading[slot].x, c.heading[slot].y, 1.0
            gap = 0.0 - bodies
        c.toward[slot].x, c.toward[slot].y = dx / distance, dy / distance
        reach = c.reach[slot]
        if c.walled[target] and reach <= ARMS_LENGTH:
            gap = least(gap, to_walls(c, slot, target))
        swings = c.windup[slot] >= 0.0 or beams and c.beaming[slot]
        beyond = gap > reach + EDGE_TOLERANCE
        near = (
            (not beyond or swings and gap <= reach + c.slop[slot])
            and gap >= c.reach_min[slot]
            and c.can_attack[slot]
            and (not hides or c.visible[c.owner[slot] * c.capacity + target])
            and (not zones or inside_zone(c, slot, target))
        )
        if beams:
            c.beaming[slot] = c.beaming[slot] and near
        c.gap[slot] = gap
        c.in_reach[slot] = near
        if guns_walking and c.walks[slot] and not c.looks_around[slot]:
            continue  # a unit that fires while it walks stays on its way
        c.goal[slot] = c.pos[target]
        c.stop_at[slot] = bodies + most(reach - CHASE_SLACK, 0.0)
        c.wants[slot] = beyond and (not near or rolling_guns and c.rolling[slot]) and not c.holds[slot]


cdef double to_walls(Columns c, int64_t slot, int64_t target) noexcept:
    """Return the distance from a unit's edge to a structure's walls, which may keep the middle out of reach."""
    cdef double x = most(fabs(c.pos[slot].x - c.pos[target].x) - c.walls[target].x, 0.0)
    cdef double y = most(fabs(c.pos[slot].y - c.pos[target].y) - c.walls[target].y, 0.0)
    return length(x, y) - most(c.radius[slot], BESIDE_WALLS)
