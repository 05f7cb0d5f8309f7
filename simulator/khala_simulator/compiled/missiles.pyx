"""Missiles, compiled; `systems.missiles` has the rules, and sends on those that bounce."""
cimport numpy as cnp
from libc.stdint cimport int64_t
from libc.stdlib cimport free, malloc

from khala_simulator.compiled.columns cimport Columns, Point, boolean, columns_of
from khala_simulator.compiled.damage cimport hit_with
from khala_simulator.compiled.numbers cimport count, least, length, most
from khala_simulator.compiled.shots cimport Missile, Shot, append, as_tuple, emptied
from khala_simulator.compiled.tables cimport Hit, Tables, Weapon, tables_of

from khala_simulator.systems import missiles as rules

cnp.import_array()

cdef int64_t NOBODY = -1
cdef double NO_DISTANCE = 1e-12


def fly(world):
    """Move all missiles by one loop and carry out the hits of those that arrive."""
    table = world.missiles
    cdef object rows = table.rows
    cdef Py_ssize_t n = count(rows), arrived = 0, i, k = 0
    if not n:
        return
    cdef Columns c = columns_of(world)
    cdef Missile* missiles = <Missile*>cnp.PyArray_DATA(<cnp.ndarray>rows)
    cdef Missile* onward
    cdef boolean* arrives = <boolean*>malloc(n)
    if arrives == NULL:
        raise MemoryError
    try:
        for i in range(n):
            arrives[i] = step(c, &missiles[i])
            arrived += arrives[i]
        if not arrived:
            return
        emptied(table, n - arrived)
        onward = <Missile*>cnp.PyArray_DATA(<cnp.ndarray>table.rows)
        for i in range(n):
            if not arrives[i]:
                onward[k] = missiles[i]
                k += 1
        for i in range(n):
            if arrives[i]:
                hit_with(world, &missiles[i].shot)
                if bounces(tables_of(world), &missiles[i].shot):
                    rules.bounce(world, as_tuple(&missiles[i].shot))
    finally:
        free(arrives)


cdef bint step(Columns c, Missile* missile) noexcept:
    """Move a missile by one loop; return whether it arrives."""
    cdef int64_t target = missile.shot.target
    cdef double body = 0.0, distance, share
    cdef Point goal, pos = missile.pos
    if target != NOBODY:
        body = c.radius[target]
        missile.shot.goal = c.pos[target]
    goal = missile.shot.goal
    missile.step = least(missile.step + missile.gain, missile.top)
    distance = length(goal.x - pos.x, goal.y - pos.y)
    share = missile.step / most(distance, NO_DISTANCE)
    missile.pos.x, missile.pos.y = pos.x + (goal.x - pos.x) * share, pos.y + (goal.y - pos.y) * share
    return distance - body <= missile.step


cdef bint bounces(Tables tables, Shot* shot) noexcept:
    """Return whether the next hit of a shot's weapon leaves from this one's target."""
    cdef Weapon* weapon = tables.weapon(shot.weapon)
    return shot.hit + 1 < weapon.hits and tables.hits[weapon.first_hit + shot.hit + 1].bounces


cdef launch(object world, Shot* shot, Hit* hit):
    """Send the missile of a hit on its way."""
    cdef Missile missile
    missile.shot, missile.pos = shot[0], shot.start
    missile.step, missile.top, missile.gain = hit.first_speed, hit.speed, hit.gain
    append(world.missiles, &missile, 1)
