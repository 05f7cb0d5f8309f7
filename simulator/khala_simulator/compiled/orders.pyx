"""Orders, compiled: which ones are finished; `abilities.commands` begins the next."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.compiled.crowds cimport Crowd, packed
from khala_simulator.compiled.numbers cimport count, ints

from khala_simulator.abilities import commands
from khala_simulator.systems import orders as rules
from khala_simulator.tables.mechanics import MECHANICS

cnp.import_array()

cdef int64_t NOBODY = -1
cdef int64_t CROWD_PERIOD = rules.CROWD_PERIOD
cdef int64_t CROWD_STALL = MECHANICS.crowd_stall
cdef int64_t SCAN_PERIOD = MECHANICS.scan_period
cdef double ARRIVAL_RADIUS_SQUARED = MECHANICS.arrival_radius**2


def carry_out(world):
    """End every order whose point is reached or whose target is gone, and begin the next one."""
    cdef list slots = []
    if world.orders_changed or world.fog or world.hiding:
        world.orders_changed = False
        find_lost(columns_of(world), world.top, slots)
    find_arrived(world, columns_of(world), slots)
    for slot in slots:
        commands.begin_next(world, slot)


cdef find_lost(Columns c, Py_ssize_t n, list found):
    """Add slots whose target is dead or out of their owner's sight."""
    cdef Py_ssize_t slot
    for slot in range(n):
        if c.needs_target[slot]:
            if c.order_target[slot] == NOBODY or not c.visible[c.owner[slot] * c.capacity + c.order_target[slot]]:
                found.append(slot)


cdef find_arrived(world, Columns c, list found):
    """Add slots whose walk has reached its point, or as near as the crowd there or the terrain allows."""
    cdef Py_ssize_t n = world.top, slot
    cdef int64_t loop = world.loop
    cdef bint just_looked = loop % SCAN_PERIOD == 1
    cdef bint looks_at_crowds = just_looked or loop % CROWD_PERIOD == 0
    cdef double x, y
    cdef object live = world.live
    cdef Crowd crowd
    crowd.live, crowd.units, crowd.loop, crowd.area = ints(live), count(live), loop, -1.0
    for slot in range(n):
        if not c.walks[slot]:
            continue
        if c.looks_around[slot]:  # an attack on a place goes on until it has just looked in vain
            if c.target[slot] != NOBODY or c.acquires[slot] and not (just_looked and c.scan_loop[slot] > loop):
                continue
        x, y = c.order_point[slot].x - c.pos[slot].x, c.order_point[slot].y - c.pos[slot].y
        if x * x + y * y <= ARRIVAL_RADIUS_SQUARED or c.nav_end[slot]:
            found.append(slot)
        elif looks_at_crowds and (c.blocked[slot] > 0 or loop - c.nav_best_loop[slot] > CROWD_STALL):
            if packed(c, &crowd, slot):
                found.append(slot)
