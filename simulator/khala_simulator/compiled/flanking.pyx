"""Flanking, compiled; `systems.flanking` has the rules."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.systems.acquire cimport is_foe, rank_of
from khala_simulator.native.columns cimport Columns
from khala_simulator.compiled.flow cimport Flow, Walker, flow_around
from khala_simulator.compiled.numbers cimport count, floats, ints, least, length, most, new_floats, new_ints
from khala_simulator.compiled.surfaces cimport grid_of

from khala_simulator.systems import flanking as rules
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import GROUND_PLANE as _GROUND_PLANE

cnp.import_array()

cdef int64_t NOBODY = -1
cdef int64_t AIR = rules.AIR
cdef int64_t LED = rules.LED
cdef int64_t GROUND_PLANE = _GROUND_PLANE
cdef double RANK_STEP = rules.RANK_STEP
cdef double REACH = MECHANICS.flank_reach
cdef double LOOK = MECHANICS.flank_look
cdef double SQUEEZE = MECHANICS.flank_squeeze
cdef double CHASE_SLACK = MECHANICS.chase_slack
cdef int64_t DETOUR_LOOPS = MECHANICS.detour_loops


cdef lead(object world, Columns c):
    """Write ``aside`` and ``detour`` of pursuers for whom there is a way, of the same kind as some that are blocked.

    Those that have a side to go round on are blocked.
    """
    cdef Py_ssize_t n = world.top, many = 0, kind, i, first = 0
    cdef int64_t slot
    cdef bint blocked
    cdef cnp.ndarray found = new_ints(n), room
    cdef int64_t* slots = ints(found)
    cdef Walker* walkers
    for slot in range(n):
        if pursues(c, slot):
            slots[many] = slot
            many += 1
    if not many:
        return
    room = new_floats(many * <Py_ssize_t>(sizeof(Walker) // sizeof(double)))
    walkers = <Walker*>floats(room)
    while many:  # those of one kind after the other
        kind, first, blocked = 0, 0, False
        for i in range(many):
            slot = slots[i]
            if i == 0 or alike(c, walkers[0].slot, slot):
                walkers[kind].slot, walkers[kind].at = slot, c.pos[slot]
                walkers[kind].ahead, walkers[kind].goal = c.pos[slot], c.pos[c.target[slot]]
                blocked |= c.detour[slot] != 0
                kind += 1
            else:
                slots[first] = slot
                first += 1
        many = first
        if blocked:
            follow(world, c, walkers, kind)


cdef bint pursues(Columns c, int64_t slot) noexcept:
    """Return whether a melee unit is on its way to a target that is near; structures are reached at their walls."""
    return (
        c.wants[slot]
        and c.target[slot] != NOBODY
        and c.layer[slot] != AIR
        and (not c.walks[slot] or c.looks_around[slot])
        and c.reach[slot] <= REACH
        and c.gap[slot] < LOOK
        and not c.walled[c.target[slot]]
    )


cdef bint chooses(Columns c, int64_t slot) noexcept:
    """Return whether a unit chooses its targets for itself."""
    return c.looks_around[slot] and c.acquires[slot]


cdef bint alike(Columns c, int64_t one, int64_t other) noexcept:
    """Return whether two units agree in owner, size and layer, and in target if they do not choose for themselves."""
    return (
        c.owner[one] == c.owner[other]
        and c.layer[one] == c.layer[other]
        and c.separation[one] == c.separation[other]
        and chooses(c, one) == chooses(c, other)
        and (chooses(c, one) or c.target[one] == c.target[other])
    )


cdef follow(object world, Columns c, Walker* walkers, Py_ssize_t k):
    """Lead units of one kind to the nearest free places in reach of any of their foes."""
    cdef int64_t one = walkers[0].slot, slot
    cdef cnp.ndarray live = world.live
    cdef Flow flow = flow_around(grid_of(world.ground, c.layer[one]), walkers, k)
    cdef double width = c.separation[one], reach = c.radius[one] + c.reach[one], best = 0.0, x, y, distance
    cdef bint picks = chooses(c, one)
    cdef Py_ssize_t i
    for i in range(k):
        slot = walkers[i].slot
        reach = least(reach, c.radius[slot] + c.reach[slot])
        best = most(best, rank_of(c, slot, c.target[slot]))
    for i in range(count(live)):
        slot = ints(live)[i]
        if stands_in_the_way(c, one, slot):
            flow.stand(c.pos[slot], c.separation[slot] + (width - SQUEEZE))
        if is_good(c, one, slot, best) if picks else slot == c.target[one]:
            flow.reach(c.pos[slot], most(c.radius[slot] + reach, c.separation[slot] + width) - CHASE_SLACK)
    flow.find(walkers, k, 2.0 * width - SQUEEZE)
    for i in range(k):
        slot = walkers[i].slot
        x, y = walkers[i].ahead.x - walkers[i].at.x, walkers[i].ahead.y - walkers[i].at.y
        distance = length(x, y)
        if walkers[i].found and distance > 0.0:
            c.aside[slot].x, c.aside[slot].y = x / most(distance, 1e-9), y / most(distance, 1e-9)
            c.detour[slot] = -LED if c.detour[slot] < 0 else LED
            c.detour_end[slot] = <int64_t>world.loop + DETOUR_LOOPS


cdef bint stands_in_the_way(Columns c, int64_t one, int64_t slot) noexcept:
    """Return whether a unit has to go around a body: an enemy that stands, or a friend that fights or holds."""
    return (
        not c.walled[slot]
        and not c.wants[slot]
        and c.layer_bits[slot] & c.layer_bits[one] != 0
        and (c.target[slot] != NOBODY or c.holds[slot] or c.owner[slot] != c.owner[one])
    )


cdef bint is_good(Columns c, int64_t one, int64_t slot, double best) noexcept:
    """Return whether a unit is an enemy that is as good as the best target of its pursuers."""
    return (
        is_foe(c, c.owner[one], slot)
        and not c.walled[slot]
        and c.plane_bits[slot] & GROUND_PLANE != 0
        and rank_of(c, one, slot) > best - RANK_STEP
    )
