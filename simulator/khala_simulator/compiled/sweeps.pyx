"""Sweeps, compiled; `systems.sweeps` has the rules."""
cimport numpy as cnp
from libc.math cimport sqrt
from libc.stdint cimport int64_t
from libc.stdlib cimport free, malloc

from khala_simulator.compiled.columns cimport Columns, Point, columns_of
from khala_simulator.compiled.damage cimport hit_target, touches
from khala_simulator.compiled.numbers cimport count, floats, ints, length
from khala_simulator.compiled.shots cimport PendingHit, Shot, append, as_tuple, from_tuple
from khala_simulator.compiled.tables cimport Hit, Line, LinePoint, Tables, tables_of

from khala_simulator.systems import sweeps as rules
from khala_simulator.world.shots import Sweep

cnp.import_array()

cdef int64_t NOBODY = -1
cdef double ON_TARGET = rules.ON_TARGET


def run(world):
    """Draw the points of all sweeps whose time has come."""
    if not world.sweeps:
        return
    for sweep in world.sweeps:
        draw(world, sweep)
    drop_ended(world)


cdef begin(object world, Shot* shot, double begun):
    """Start the sweep of a shot whose damage point was at the (fractional) loop ``begun``."""
    sweep = Sweep(as_tuple(shot), begun, 0, [])
    world.sweeps.append(sweep)
    draw(world, sweep)
    drop_ended(world)


cdef drop_ended(object world):
    """Forget the sweeps that are at their end, or whose attacker is gone."""
    cdef Tables tables = tables_of(world)
    cdef list ahead = []
    for sweep in world.sweeps:
        shot = sweep.shot
        if shot.source != NOBODY and <Py_ssize_t>sweep.ahead < hit_of(tables, shot).line.count:
            ahead.append(sweep)
    world.sweeps = ahead


cdef Hit* hit_of(Tables tables, object shot):
    """Return the row of a shot's hit."""
    return &tables.hits[tables.weapon(shot.weapon).first_hit + <Py_ssize_t>shot.hit]


cdef draw(object world, object sweep):
    """Touch the units at the points that are due."""
    if sweep.shot.source == NOBODY:
        return
    cdef Tables tables = tables_of(world)
    cdef Hit* hit = hit_of(tables, sweep.shot)
    cdef Line* line = &hit.line
    cdef double begun = sweep.begun
    cdef Py_ssize_t first = sweep.ahead, end = first, drawn, i, reached
    cdef int64_t loop = world.loop, slot
    while end < line.count and begun + line.points[end].delay <= loop:
        end += 1
    if end == first:
        return
    sweep.ahead = end
    cdef Columns c = columns_of(world)
    cdef Shot shot = from_tuple(sweep.shot)
    cdef double reach = floats(world.stats.range)[shot.owner * tables.weapon_count + shot.weapon]
    cdef object live = world.live
    cdef int64_t* slots = ints(live)
    cdef list touched = sweep.touched
    cdef Point* places = <Point*>malloc((end - first) * sizeof(Point))
    if places == NULL:
        raise MemoryError
    try:
        drawn = place(line, &shot, first, end, reach, places)
        for i in range(count(live)):
            slot = slots[i]
            if not touches(c, &hit.affects, &shot, slot):
                continue
            reached = first_within(places, drawn, c.pos[slot], line.radius + c.radius[slot])
            if reached < drawn and slot not in touched:
                touched.append(slot)
                touch(world, c, line, shot, slot, begun + line.points[first + reached].delay)
    finally:
        free(places)


cdef Py_ssize_t place(Line* line, Shot* shot, Py_ssize_t first, Py_ssize_t end, double reach, Point* places) noexcept:
    """Write where some points of a line are, without those past the weapon's reach; return how many are left."""
    cdef double forward_x = shot.goal.x - shot.start.x, forward_y = shot.goal.y - shot.start.y
    cdef double distance = sqrt(forward_x * forward_x + forward_y * forward_y)
    cdef Point origin = shot.start if line.from_source else shot.goal
    cdef LinePoint* point
    cdef Py_ssize_t drawn = 0, i
    if distance > ON_TARGET:
        forward_x, forward_y = forward_x / distance, forward_y / distance
    else:
        forward_x, forward_y = 0.0, -1.0
    for i in range(first, end):
        point = &line.points[i]
        if line.from_source and not -point.along <= reach + line.past_range:
            continue
        places[drawn].x = origin.x + (point.across * forward_y - point.along * forward_x)
        places[drawn].y = origin.y + (-point.across * forward_x - point.along * forward_y)
        drawn += 1
    return drawn


cdef Py_ssize_t first_within(Point* places, Py_ssize_t drawn, Point middle, double reach) noexcept:
    """Return the first place within a distance from a unit's middle; behind the last one if there is none."""
    cdef Py_ssize_t i
    for i in range(drawn):
        if length(middle.x - places[i].x, middle.y - places[i].y) <= reach:
            return i
    return drawn


cdef touch(object world, Columns c, Line* line, Shot shot, int64_t slot, double moment):
    """Hit a unit now, or when the lag has passed."""
    cdef PendingHit later
    shot.target = slot
    if line.lag <= 0.0:
        hit_target(world, &shot)
        return
    shot.goal = c.pos[slot]
    later.shot, later.due, later.single = shot, moment + line.lag, True
    append(world.pending, &later, 1)
