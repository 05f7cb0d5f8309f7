"""Harvesting, compiled: which workers are due for the next phase of their round; `systems.harvest` leads them."""
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of

from khala_simulator.economy.harvesting import Phase
from khala_simulator.systems.harvest import STEPS

cdef int64_t TO_RESOURCE = Phase.TO_RESOURCE
cdef int64_t TO_HALL = Phase.TO_HALL
cdef dict LEAD = {int(phase): step for phase, step in STEPS.items()}


def run(world):
    """Lead every worker that harvests through its round by one loop."""
    if not world.harvesting:
        return
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t slot, n = world.top
    cdef int64_t phase
    cdef bint harvests = False
    cdef double loop = world.loop
    cdef list due = []
    for slot in range(n):
        phase = c.harvest[slot]
        if phase > 0:
            harvests = True
            if phase == TO_RESOURCE or phase == TO_HALL:
                if not c.wants[slot] and c.can_act[slot]:
                    due.append(slot)
            elif c.work_until[slot] <= loop:
                due.append(slot)
    world.harvesting = harvests
    for slot in due:
        LEAD[columns_of(world).harvest[slot]](world, slot)
