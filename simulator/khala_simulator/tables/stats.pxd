cimport cython
from libc.stdint cimport int64_t


cdef class Damage:
    cdef readonly object hit
    cdef readonly double amount
    cdef readonly tuple bonus
    cdef readonly str kind
    cdef readonly bint ignores_armor
    cdef readonly bint plain
    cdef readonly bint follows
    cdef readonly double delay
    cdef readonly bint conditional


cdef class Stats:
    cdef readonly object catalog
    cdef readonly int64_t weapons
    cdef readonly int64_t types
    cdef public object life_max
    cdef public object shields_max
    cdef public object energy_max
    cdef public object energy_start
    cdef public object armor
    cdef public object shield_armor
    cdef public object sight
    cdef public object step
    cdef public object creep_factor
    cdef public object step_gain
    cdef public object life_regen
    cdef public object shield_regen
    cdef public object energy_regen
    cdef public object range
    cdef public object scan
    cdef public object period
    cdef public list damage
    cdef readonly object attribute_bits
    cdef readonly object layer_bits
    cdef readonly object plane_bits
    cdef readonly object beam
    cdef readonly object bursts
    cdef readonly object kamikaze
    cdef readonly object backswing
    cdef readonly object damage_point
    cdef readonly object least_range
    cdef readonly object slop
    cdef readonly object rolling
    cdef readonly object turreted
    cdef readonly object aim_cos
    cdef readonly object excluding
    cdef readonly object has_turret
    cdef readonly object has_beam
    cdef readonly object has_rolling_gun
    cdef readonly object unturnable
    cdef readonly object uncommandable
    cdef readonly object untargetable
    cdef readonly object jitter
    cdef list _changes
    cdef list _abilities
    @cython.locals(twin=Stats)
    cpdef Stats copy(self)
