"""Movement, compiled; `systems.movement` has the rules."""
cimport numpy as cnp
from libc.math cimport isfinite, sqrt
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.compiled.numbers cimport count, floats, ints, least, length, most, new_floats
from khala_simulator.movement.turning cimport turned

from khala_simulator.systems import movement as rules
from khala_simulator.world.census import census

cnp.import_array()

cdef double TURNING_CIRCLES = rules.TURNING_CIRCLES

cdef struct Walk:
    int64_t slot
    Point way  # unit vector
    double speed
    double step
    double left  # to its corner or goal
    double error_cos  # between its heading and that way


def move(world):
    """Choose this loop's steps and turn; writes ``intended``, ``speed`` and ``heading``."""
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t n = world.top, slot, walking = 0
    cdef bint drifts, anyone
    kinds = census(world)
    drifts = kinds.drifting_flyers
    anyone = False
    for slot in range(n):
        walking += c.wants[slot]
        anyone |= drifts and coasts(c, slot)
    if anyone or walking:
        for slot in range(n):
            if c.wants[slot]:
                continue
            if drifts and coasts(c, slot):
                drift(c, slot)
            else:
                c.speed[slot] = c.intended[slot].x = c.intended[slot].y = 0.0
        if walking:
            walk(world, c, n, walking, kinds.brakers)
        world.anyone_moved = True
    elif world.anyone_moved:
        for slot in range(n):
            c.speed[slot] = c.intended[slot].x = c.intended[slot].y = 0.0
        world.anyone_moved = False
    face_targets(world, c)


cdef face_targets(world, Columns c):
    """Turn units that stand and fight to their target; turrets and units that can't turn keep the body's heading."""
    cdef cnp.ndarray fighters = world.fighters
    cdef int64_t* slots = ints(fighters)
    cdef int64_t slot
    cdef Py_ssize_t i, n = count(fighters)
    cdef bint turning = False
    for i in range(n):
        slot = slots[i]
        turning |= faces(c, slot) and (c.heading[slot].x != c.toward[slot].x or c.heading[slot].y != c.toward[slot].y)
    if turning:
        for i in range(n):
            slot = slots[i]
            if faces(c, slot):
                c.heading[slot] = turned(
                    c.heading[slot], c.toward[slot], c.turn_still_cos[slot], c.turn_still_sin[slot]
                )


cdef inline bint faces(Columns c, int64_t slot) noexcept:
    """Return whether a fighter turns to its target."""
    return c.aim_cos[slot] > -1.0 and not c.turreted[slot] and not c.wants[slot]


# flyers that stop -----------------------------------------------------------------------------------------------------


cdef inline bint coasts(Columns c, Py_ssize_t slot) noexcept:
    """Return whether a flyer has speed left and nowhere to go."""
    return c.glides[slot] and c.speed[slot] > 0.0 and not c.wants[slot] and c.step_max[slot] > 0.0


cdef void drift(Columns c, Py_ssize_t slot) noexcept:
    """Write the step of a flyer that coasts: as its last one, a little shorter."""
    cdef Point* last = &c.intended[slot]
    cdef double share = most(c.speed[slot] - c.step_loss[slot], 0.0) / most(length(last.x, last.y), 1e-12)
    last.x *= share
    last.y *= share
    c.speed[slot] = length(last.x, last.y)


# walkers --------------------------------------------------------------------------------------------------------------


cdef walk(world, Columns c, Py_ssize_t n, Py_ssize_t walking, bint brakers):
    """Choose the steps of all walkers, and turn them."""
    cdef cnp.ndarray room = new_floats(walking * <Py_ssize_t>(sizeof(Walk) // sizeof(double)))
    cdef Walk* walks = <Walk*>floats(room)
    cdef Walk* w
    cdef Py_ssize_t slot, i = 0
    cdef bint late = False
    cdef cnp.ndarray covered
    cdef boolean* creep = NULL
    cdef int64_t width = 0, height = 0
    if world.growth.anywhere:
        width, height = world.map.terrain.size
        covered = cnp.PyArray_GETCONTIGUOUS(world.creep)
        creep = <boolean*>cnp.PyArray_DATA(covered)
    queue = world.queue
    for slot in range(n):
        if c.wants[slot]:
            w = &walks[i]
            i += 1
            w.slot = slot
            w.speed = top_speed(c, slot, creep, width, height)
            choose(c, w, brakers, queue)
            w.error_cos = c.heading[slot].x * w.way.x + c.heading[slot].y * w.way.y
            late |= w.error_cos < c.turn_cos[slot]
    for i in range(walking):
        w = &walks[i]
        if late:
            turn(c, w)
        else:
            c.heading[w.slot] = w.way
        c.speed[w.slot] = w.speed
        c.intended[w.slot].x, c.intended[w.slot].y = w.way.x * w.step, w.way.y * w.step


cdef double top_speed(Columns c, Py_ssize_t slot, boolean* creep, int64_t width, int64_t height) noexcept:
    """Return a unit's largest speed where it stands."""
    cdef int64_t x, y
    if creep == NULL:
        return c.step_max[slot]
    x, y = min(max(<int64_t>c.pos[slot].x, 0), width - 1), min(max(<int64_t>c.pos[slot].y, 0), height - 1)
    return c.step_max[slot] * c.creep_factor[slot] if creep[y * width + x] else c.step_max[slot]


cdef choose(Columns c, Walk* w, bint brakers, list queue):
    """Choose the way and the step of a walker of some top speed."""
    cdef Py_ssize_t slot = w.slot
    cdef double x = c.nav_point[slot].x - c.pos[slot].x, y = c.nav_point[slot].y - c.pos[slot].y
    cdef double distance = length(x, y), size = most(distance, 1e-12), loss, slowest
    w.left = most(distance - c.stop_at[slot] * c.nav_straight[slot], 0.0)
    w.speed = least(c.speed[slot] + c.step_gain[slot], w.speed)
    if brakers and c.nav_straight[slot] and isfinite(c.step_loss[slot]):
        loss = c.step_loss[slot]
        slowest = sqrt(2.0 * loss * w.left + 0.25 * loss * loss) - 0.5 * loss
        if slowest < w.speed and not queue[slot]:
            w.speed = slowest
    w.step = least(w.speed, w.left)
    if not w.step > 0.0:
        w.way = c.heading[slot]
    elif c.detour[slot] != 0 and (c.aside[slot].x != 0.0 or c.aside[slot].y != 0.0):
        w.way = c.aside[slot]
    else:
        w.way.x, w.way.y = x / size, y / size


cdef void turn(Columns c, Walk* w) noexcept:
    """Turn a walker to the way it wants to go; write how far and which way it moves meanwhile."""
    cdef Py_ssize_t slot = w.slot
    cdef bint standing = c.speed[slot] <= 0.0 or w.error_cos < 0.0, late = w.error_cos < c.turn_cos[slot]
    cdef double cos_step = c.turn_still_cos[slot] if standing else c.turn_cos[slot]
    cdef double sin_step = c.turn_still_sin[slot] if standing else c.turn_sin[slot]
    cdef Point facing = turned(c.heading[slot], w.way, cos_step, sin_step)
    cdef bint swings = c.glides[slot] and w.left > TURNING_CIRCLES * w.step
    c.heading[slot] = facing
    if late and not swings:
        w.step *= most(facing.x * w.way.x + facing.y * w.way.y, 0.0)
    if swings:
        w.way = facing
