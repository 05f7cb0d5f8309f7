"""The catalog's weapons, hits and types as compiled systems read them."""
from libc.stdint cimport int64_t

cdef enum:
    ANY_PLANE = -1

cdef enum Kind:
    SPELL
    RANGED
    MELEE
    SPLASH

cdef struct Affects:
    bint allies
    bint neutral
    bint only_structures
    bint no_structures
    bint not_self
    bint not_target
    int64_t planes  # of which the unit has to be on one

cdef struct LinePoint:
    double delay  # loops from the damage point until it touches
    double across
    double along

cdef struct Line:
    LinePoint* points
    Py_ssize_t count
    double radius
    double lag  # loops from a touch to the hit
    double past_range
    bint from_source

cdef struct Hit:
    double delay  # loops from the damage point until it is due; 0 for a sweep, which counts itself
    double speed  # of its missile, world units per loop
    double first_speed  # with which the missile leaves
    double gain  # of its speed, per loop
    Kind kind
    bint flies  # as a missile
    bint sweeps
    bint bounces  # it leaves from the last victim
    bint conditional  # the game's own switch may leave it out
    bint ignores_armor
    bint impacts  # it does more to its target than damage
    bint plain  # it is dealt to its target alone
    bint splashes
    Affects affects  # of its splash or its sweep
    Line line  # of its sweep

cdef struct Weapon:
    Py_ssize_t first_hit
    Py_ssize_t hits
    double damage_point  # loops
    double backswing  # loops
    double delay  # random, loops
    double delay_more  # up to so much more than that
    double min_range
    double slop
    double aim_cos
    int64_t excluding  # attribute bits that it can't be aimed at
    bint beam
    bint kamikaze
    bint launches
    bint rolling  # it fires while the body goes where it wants
    bint turreted

cdef class Tables:
    """One catalog's rows."""

    cdef Weapon* weapons
    cdef Py_ssize_t weapon_count
    cdef Hit* hits
    cdef bint* unturnable  # per type of unit

    cdef inline Weapon* weapon(self, int64_t row) noexcept:
        """Return a row; a negative one counts from the end, as in Python."""
        return &self.weapons[row if row >= 0 else row + self.weapon_count]

cdef Tables tables_of(object world)
