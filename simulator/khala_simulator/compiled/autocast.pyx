"""Autocast, compiled: who has nothing to use; `systems.autocast` has the rules."""
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns, columns_of

from khala_simulator.abilities import casting
from khala_simulator.economy.requirements import missing_to_all
from khala_simulator.systems import autocast as rules
from khala_simulator.tables.mechanics import MECHANICS

cdef int64_t NOBODY = -1
cdef int64_t SCAN_PERIOD = MECHANICS.scan_period


def look_out(world):
    """Make every unit with autocast use its abilities, in the order of slots."""
    cdef dict settings = world.autocast
    if not settings or <int64_t>world.loop % SCAN_PERIOD:
        return
    cdef dict closed = {}  # to the units of one owner: (owner, ability) -> whether it is
    cdef int64_t slot
    cdef Columns c
    for slot in sorted(settings):
        c = columns_of(world)
        if c.carrier[slot] == NOBODY and c.can_cast[slot] and not c.casts[slot]:
            for number in settings[slot]:
                key = (c.owner[slot], number)
                hopeless = closed.get(key)
                if hopeless is None:
                    ability = world.catalog.ability(number)
                    hopeless = ability.effect not in casting.ORDINARY and missing_to_all(world, slot, ability)
                    closed[key] = hopeless
                if not hopeless and rules.attempt(world, slot, casting.as_is(world, slot, world.catalog.ability(number))):
                    closed.clear()
                    break
