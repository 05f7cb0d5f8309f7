"""A unit begins and ends a fight, as `combat.targets` has it; that chooses between weapons, too."""
from libc.math cimport INFINITY
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns
from khala_simulator.compiled.numbers cimport floats, ints, least, most
from khala_simulator.compiled.tables cimport Tables, Weapon, tables_of

from khala_simulator.combat import targets as rules
from khala_simulator.tables import stats

cdef int64_t NOBODY = -1
cdef int64_t GROUND_PLANE = stats.GROUND_PLANE


cdef engage(object world, Columns c, int64_t slot, int64_t target):
    """Make a unit fight a target with the weapon that fits, if it has one."""
    cdef Tables tables = tables_of(world)
    cdef int64_t row = weapon_for(world, c, tables, slot, target)
    if row < 0:
        return
    cdef Weapon* weapon = tables.weapon(row)
    if c.target[slot] != target:
        drop_attack(c, slot)
    c.target[slot] = target
    c.weapon[slot] = row
    measure_reach(c, floats(world.stats.range)[c.owner[slot] * tables.weapon_count + row], slot, target)
    c.reach_min[slot] = -INFINITY if c.close_weapon[slot] >= 0 or weapon.min_range == 0.0 else weapon.min_range
    c.slop[slot] = weapon.slop
    c.rolling[slot] = weapon.rolling
    c.turreted[slot] = weapon.turreted
    c.aim_cos[slot] = -1.0 if not weapon.turreted and tables.unturnable[c.type[slot]] else weapon.aim_cos
    c.nav_loop[slot] = 0


cdef int64_t weapon_for(object world, Columns c, Tables tables, int64_t slot, int64_t target) except -2:
    """Return the row of the weapon that a unit can aim at a target now, or -1."""
    cdef int64_t planes = c.plane_bits[target], row
    cdef int64_t ground = c.ground_weapon[slot] if planes & GROUND_PLANE else -1
    cdef int64_t air = c.air_weapon[slot] if planes != GROUND_PLANE else -1
    if ground >= 0 and air >= 0 and ground != air:
        return rules.weapon_for(world, slot, target)
    row = ground if ground >= air else air
    if row >= 0 and tables.weapons[row].excluding:
        if tables.weapons[row].excluding & ints(world.stats.attribute_bits)[c.type[target]]:
            return -1
    return row


cdef void measure_reach(Columns c, double plain, int64_t slot, int64_t target) noexcept:
    """Write the reach of a weapon of this range; a unit that touches another one reaches it."""
    cdef double touch = c.separation[slot] + c.separation[target] - c.radius[slot] - c.radius[target]
    c.reach[slot] = most(most(plain + c.range_add[slot], least(plain, 0.0)), touch)


cdef void drop_attack(Columns c, int64_t slot) noexcept:
    """Drop an attack that is started and has not taken effect; it leaves no cooldown."""
    c.beaming[slot] = False
    if c.windup[slot] >= 0.0:
        c.windup[slot] = -1.0
        c.cooldown[slot] = 0.0


cdef void disengage(Columns c, int64_t slot) noexcept:
    """Make a unit stop fighting; the caller sets ``scan_now``."""
    drop_attack(c, slot)
    c.target[slot] = NOBODY
    c.weapon[slot] = -1
    c.rolling[slot] = c.turreted[slot] = False
    c.nav_loop[slot] = 0
