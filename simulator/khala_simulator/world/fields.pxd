from libc.stdint cimport int64_t

from khala_simulator.tables.stats cimport Stats
from khala_simulator.world.active_buffs cimport ActiveBuffs
from khala_simulator.world.ground cimport BuiltGround


cdef class WorldFields:
    # of `World`
    cdef public object map
    cdef public object rng
    cdef public object catalog
    cdef public Stats stats
    cdef public BuiltGround ground
    cdef public object growth
    cdef public object usual
    cdef public object script
    cdef public bint watches
    cdef public frozenset moments
    cdef public tuple periods
    cdef public ActiveBuffs buffs
    cdef public list players
    cdef public double west
    cdef public double south
    cdef public double east
    cdef public double north
    cdef public bint fog
    cdef public bint ended
    cdef public int64_t loop
    cdef public int64_t top
    cdef public object live
    cdef public object recycles
    cdef public object visible
    cdef public object visibility
    cdef public list memories
    cdef public list queue
    cdef public list missiles
    cdef public list pending
    cdef public list sweeps
    cdef public list area_effects
    cdef public list hurt
    cdef public list deaths
    cdef public int64_t deaths_seen
    cdef public dict timers
    cdef public dict autocast
    cdef public dict channelling
    cdef public dict jobs
    cdef public bint scan_now

    # of `UnitColumns`
    cdef public int64_t capacity
    cdef public object native

    # notes
    cdef public int64_t population
    cdef public int64_t looked_at
    cdef public int64_t resting_version
    cdef public object bodies
    cdef public object steps
    cdef public object foes
    cdef public object crowd
    cdef public object census
    cdef public list casters
    cdef public int64_t bare_at
    cdef public object tally
    cdef public int64_t tallied
    cdef public tuple regenerating
    cdef public bint harvesting
    cdef public bint mortal
    cdef public bint hiding
    cdef public list natures
    cdef public int64_t natures_at
    cdef public tuple opponents
    cdef public tuple taken
    cdef public object eyes
    cdef public int64_t powered_at
    cdef public object fighters
    cdef public bint anyone_moved
    cdef public bint orders_changed
