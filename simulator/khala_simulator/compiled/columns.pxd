# Written by khala_simulator.compiled.declare from world.columns.
"""The world's columns as pointers, for compiled systems."""
from libc.stdint cimport int64_t, uint8_t

ctypedef uint8_t boolean

cdef struct Point:
    double x
    double y

cdef class Columns:
    """One world's columns; they hold until it grows."""

    cdef tuple arrays  # keeps the memory alive
    cdef Py_ssize_t capacity
    cdef boolean* visible  # (players, capacity)
    cdef boolean* alive
    cdef int64_t* tag
    cdef int64_t* type
    cdef int64_t* owner
    cdef Point* pos
    cdef Point* heading
    cdef double* speed
    cdef double* life
    cdef double* shields
    cdef double* energy
    cdef double* build_progress
    cdef boolean* burrowed
    cdef boolean* hallucination
    cdef int64_t* born_loop
    cdef int64_t* expires
    cdef int64_t* carrier
    cdef int64_t* addon
    cdef int64_t* home
    cdef double* barrier
    cdef int64_t* damaged_loop
    cdef int64_t* order_kind
    cdef int64_t* order_ability
    cdef int64_t* order_target
    cdef Point* order_point
    cdef boolean* order_aimed
    cdef Point* order_origin
    cdef double* cast_at
    cdef double* cast_begun
    cdef boolean* channels
    cdef boolean* bound
    cdef int64_t* target
    cdef int64_t* attacker
    cdef int64_t* scan_loop
    cdef Point* guard
    cdef boolean* returning
    cdef boolean* leashed
    cdef double* rank
    cdef int64_t* weapon
    cdef double* reach
    cdef double* reach_min
    cdef double* slop
    cdef double* aim_cos
    cdef boolean* turreted
    cdef boolean* rolling
    cdef boolean* beaming
    cdef Point* turret
    cdef int64_t* weapon_toggles
    cdef boolean* spent
    cdef double* cooldown
    cdef double* windup
    cdef double* backswing
    cdef double* build_loops
    cdef boolean* self_made
    cdef int64_t* site
    cdef int64_t* worked
    cdef int64_t* harvest
    cdef int64_t* patch
    cdef int64_t* occupant
    cdef int64_t* load
    cdef int64_t* contents
    cdef double* work_until
    cdef Point* zone
    cdef double* zone_radius
    cdef int64_t* help_loop
    cdef Point* nav_point
    cdef int64_t* nav_loop
    cdef boolean* nav_straight
    cdef boolean* nav_end
    cdef Point* nav_goal
    cdef double* nav_best
    cdef int64_t* nav_best_loop
    cdef int64_t* blocked
    cdef int64_t* detour
    cdef int64_t* detour_end
    cdef Point* aside
    cdef double* gap
    cdef Point* toward
    cdef boolean* in_reach
    cdef Point* intended
    cdef double* radius
    cdef double* separation
    cdef double* clearance
    cdef double* lightness
    cdef int64_t* layer
    cdef int64_t* layer_bits
    cdef int64_t* plane_bits
    cdef double* step_max
    cdef double* step_gain
    cdef double* step_loss
    cdef boolean* glides
    cdef double* turn_cos
    cdef double* turn_sin
    cdef double* turn_still_cos
    cdef double* turn_still_sin
    cdef double* priority
    cdef int64_t* ground_weapon
    cdef int64_t* air_weapon
    cdef int64_t* close_weapon
    cdef double* close_range
    cdef double* least_range
    cdef boolean* guns_walking
    cdef boolean* spares_structures
    cdef double* turret_cos
    cdef double* turret_sin
    cdef double* ground_scan
    cdef double* air_scan
    cdef boolean* acquires
    cdef int64_t* threat_bits
    cdef boolean* defensive
    cdef boolean* flees
    cdef boolean* targetable
    cdef boolean* cloaked
    cdef double* sight
    cdef double* detects
    cdef boolean* can_act
    cdef boolean* can_attack
    cdef boolean* can_cast
    cdef boolean* casts
    cdef double* attack_rate
    cdef double* range_add
    cdef double* armor_add
    cdef double* shield_armor_add
    cdef double* ranged_add
    cdef double* melee_add
    cdef double* taken_factor
    cdef double* air_taken_factor
    cdef double* dealt_factor
    cdef int64_t* bonus_bits
    cdef double* bonus_add
    cdef boolean* walks
    cdef boolean* looks_around
    cdef boolean* holds
    cdef boolean* needs_target
    cdef boolean* wants
    cdef Point* goal
    cdef double* stop_at
    cdef double* work_rate
    cdef boolean* powered
    cdef double* creep_factor
    cdef double* life_max
    cdef double* life_regen
    cdef double* life_delay
    cdef double* shields_max
    cdef double* shield_regen
    cdef double* shield_delay
    cdef double* energy_max
    cdef double* energy_regen
    cdef boolean* walled
    cdef Point* walls

cdef Columns bound(object world)

cdef inline Columns columns_of(object world):
    """Return the columns of a world, bound now if its arrays are new."""
    native = world.native
    return bound(world) if native is None else <Columns>native
