"""Collision, compiled; `systems.collision` has the rules and everything that is rare."""
cimport numpy as cnp
from libc.math cimport floor
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.native.memory cimport Point
from khala_simulator.compiled.contacts cimport Crowd, crowd_of
from khala_simulator.compiled.numbers cimport count, floats, ints, least, length, most, new_ints, new_points
from khala_simulator.compiled.pushing cimport push_apart
from khala_simulator.compiled.surfaces cimport Grid, cell_at, grid_of

from khala_simulator.compiled import avoidance
from khala_simulator.systems import collision as rules
from khala_simulator.tables.mechanics import MECHANICS

cnp.import_array()

cdef int64_t AIR = rules.AIR
cdef double SAME_POINT = rules.SAME_POINT
cdef double EDGE_MARGIN = rules.EDGE_MARGIN
cdef double BLOCKED_SHARE = MECHANICS.blocked_share
cdef int64_t DETOUR_AFTER = MECHANICS.detour_after


def separate(world):
    """Carry out this loop's steps, push bodies apart and remember blocked walkers."""
    cdef bint moved = world.anyone_moved
    if not moved and world.resting_version == world.population:
        return
    cdef Columns c = columns_of(world)
    cdef cnp.ndarray live = world.live
    cdef int64_t* slots = ints(live)
    cdef Crowd crowd = crowd_of(world)
    cdef Py_ssize_t i
    cdef Point at
    crowd.reserve(count(live), c.capacity)
    for i in range(crowd.count):
        at = crowd.before[i] = c.pos[slots[i]]
        if moved:
            at.x += c.intended[slots[i]].x
            at.y += c.intended[slots[i]].y
        crowd.after[i] = at
    crowded = push_apart(crowd, c, slots)
    keep_on_surfaces(world, crowd, c, slots)
    for i in range(crowd.count):
        c.pos[slots[i]] = crowd.after[i]
    world.resting_version = -1 if moved or crowded else world.population
    if moved:
        note_blocked(world, crowd, c, slots)


cdef keep_on_surfaces(world, Crowd crowd, Columns c, int64_t* slots):
    """Put every body that has moved where its layer allows."""
    cdef double x0, y0, x1, y1
    cdef Py_ssize_t i
    cdef int64_t layer, cell, last = -1
    cdef Point* after
    cdef Grid grid = None
    ground = world.ground
    x0, y0, x1, y1 = world.map.terrain.playable
    for i in range(crowd.count):
        after = &crowd.after[i]
        if crowd.before[i].x == after.x and crowd.before[i].y == after.y:
            continue
        layer = c.layer[slots[i]]
        if layer == AIR:
            after.x, after.y = least(most(after.x, x0), x1 - EDGE_MARGIN), least(most(after.y, y0), y1 - EDGE_MARGIN)
            continue
        if layer != last:
            grid, last = grid_of(ground, layer), layer
        cell = cell_at(grid, after.x, after.y)
        if not grid.open[cell]:
            off_walls(grid, crowd.before[i], after, cell, c.clearance[slots[i]])


cdef off_walls(Grid grid, Point before, Point* after, int64_t cell, double room):
    """Keep a body its clearance away from blocked cells; where there is no room it stays."""
    cdef Point corner, low = grid.walls_low[cell], high = grid.walls_high[cell], kept
    cdef double x, y, distance, push
    cdef int i
    corner.x, corner.y = floor(after.x + grid.shift) - grid.shift, floor(after.y + grid.shift) - grid.shift
    kept.x = least(most(after.x, corner.x + low.x * room), corner.x + 1.0 - high.x * room)
    kept.y = least(most(after.y, corner.y + low.y * room), corner.y + 1.0 - high.y * room)
    if grid.spiked[cell]:
        for i in range(4):
            if grid.spikes[i][cell]:
                x, y = kept.x - (corner.x + grid.corners[i].x), kept.y - (corner.y + grid.corners[i].y)
                distance = length(x, y)
                push = most(room - distance, 0.0) / most(distance, SAME_POINT)
                kept.x += x * push
                kept.y += y * push
    after.x = least(most(kept.x, 0.0), grid.width - EDGE_MARGIN)
    after.y = least(most(kept.y, 0.0), grid.height - EDGE_MARGIN)
    if grid.flat[cell_at(grid, after.x, after.y)]:
        return
    if grid.flat[cell_at(grid, after.x, before.y)]:
        after.y = before.y
    elif grid.flat[cell_at(grid, before.x, after.y)]:
        after.x = before.x
    elif grid.flat[cell_at(grid, before.x, before.y)]:
        after[0] = before
    else:
        out = rules.free_or_back(grid.surface, row_of(before), row_of(after[0]))
        after.x, after.y = out[0, 0], out[0, 1]


cdef cnp.ndarray row_of(Point point):
    """Return a point as an array (1, 2)."""
    cdef cnp.ndarray row = new_points(1)
    (<Point*>floats(row))[0] = point
    return row


cdef note_blocked(world, Crowd crowd, Columns c, int64_t* slots):
    """Count the loops in which walkers made no headway, and send stuck ones around the obstacle."""
    cdef Py_ssize_t i, stuck = 0
    cdef int64_t slot
    cdef double wish, along
    cdef Point intended, shift
    cdef cnp.ndarray blocked = None, shifts = None
    for i in range(crowd.count):
        slot = slots[i]
        intended = c.intended[slot]
        wish = intended.x * intended.x + intended.y * intended.y
        if not wish > 0.0:
            c.blocked[slot] = 0
            continue
        shift.x, shift.y = crowd.after[i].x - crowd.before[i].x, crowd.after[i].y - crowd.before[i].y
        along = shift.x * intended.x + shift.y * intended.y
        if along < BLOCKED_SHARE * wish:
            c.blocked[slot] += 1
            if c.blocked[slot] % DETOUR_AFTER == 0:
                if not stuck:
                    blocked, shifts = new_ints(crowd.count), new_points(crowd.count)
                shift.x -= intended.x
                shift.y -= intended.y
                ints(blocked)[stuck], (<Point*>floats(shifts))[stuck] = slot, shift
                stuck += 1
        else:
            c.blocked[slot] = max(c.blocked[slot] - 2, 0)
    if stuck:
        avoidance.begin(world, blocked[:stuck], shifts[:stuck])
