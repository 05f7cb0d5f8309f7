"""Regeneration, compiled; `systems.regeneration` has the rules."""
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns, columns_of
from khala_simulator.compiled.numbers cimport least, most


def regenerate(world):
    """Give every unit this loop's shields, life and energy, up to what its type holds."""
    cdef bint shields, life, energy
    shields, life, energy = world.regenerating
    if not (shields or life or energy):
        return
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t n = world.top, slot
    cdef int64_t loop = world.loop
    for slot in range(n):
        if c.life[slot] <= 0.0:
            continue
        if shields and c.shields[slot] < c.shields_max[slot] and c.shield_regen[slot] > 0.0:
            if c.damaged_loop[slot] < loop - c.shield_delay[slot]:
                c.shields[slot] = least(c.shields[slot] + c.shield_regen[slot], c.shields_max[slot])
        if life and c.life[slot] < c.life_max[slot] and c.life_regen[slot] > 0.0:
            if c.damaged_loop[slot] < loop - c.life_delay[slot]:
                c.life[slot] = least(c.life[slot] + c.life_regen[slot], c.life_max[slot])
        if energy and c.energy[slot] < c.energy_max[slot] and c.energy_regen[slot] > 0.0:
            c.energy[slot] = least(c.energy[slot] + c.energy_regen[slot], c.energy_max[slot])
    if energy:
        for slot in range(n):
            if c.energy_regen[slot] < 0.0:  # the rule that makes it spend checks the rest
                c.energy[slot] = most(c.energy[slot] + c.energy_regen[slot], 0.0)
