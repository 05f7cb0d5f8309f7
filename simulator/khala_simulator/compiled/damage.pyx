"""What a hit takes from which unit, as `combat.damage` has it; that does what is not damage, searches, and arcs."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.compiled.columns cimport Columns, columns_of
from khala_simulator.compiled.numbers cimport count, floats, ints, least, length, most
from khala_simulator.compiled.shots cimport Shot, as_tuple
from khala_simulator.compiled.tables cimport (
    ANY_PLANE, MELEE, RANGED, SPELL, SPLASH, Affects, Hit, Kind, Tables, tables_of,
)

from khala_simulator.combat import damage as rules
from khala_simulator.tables import stats
from khala_simulator.tables.mechanics import MECHANICS

cnp.import_array()

cdef int64_t NOBODY = -1
cdef int64_t AIR_PLANE = stats.AIR_PLANE
cdef double DAMAGE_MIN = MECHANICS.damage_min
cdef double ALL_ROUND_DEG = 360.0


cdef hit_with(object world, Shot* shot):
    """Carry out one hit: on its target, in the rings around it, or on the units that a second search finds."""
    cdef Tables tables = tables_of(world)
    cdef Hit* hit = &tables.hits[tables.weapon(shot.weapon).first_hit + shot.hit]
    if hit.plain:
        hit_target(world, shot)
    elif hit.splashes:
        splash(world, hit, shot)
    else:
        rules.hit_with(world, as_tuple(shot))


cdef hit_target(object world, Shot* shot):
    """Carry out a hit on its target alone, if that still lives."""
    if shot.target == NOBODY:
        return
    cdef Tables tables = tables_of(world)
    cdef Hit* hit = &tables.hits[tables.weapon(shot.weapon).first_hit + shot.hit]
    if hit.impacts:
        rules.hit_target(world, as_tuple(shot))
    else:
        strike(world, columns_of(world), hit, shot, shot.target, damage_of(world, shot), 1.0)


cdef object damage_of(object world, Shot* shot):
    """Return the amounts of a shot's hit after its owner's upgrades."""
    return (<tuple>(<list>(<list>world.stats.damage)[shot.owner])[shot.weapon])[shot.hit]


cdef strike(object world, Columns c, Hit* hit, Shot* shot, int64_t victim, object damage, double fraction):
    """Take one hit's damage from one unit and count it in both players' scores."""
    cdef int64_t source = shot.source, attributes = ints(world.stats.attribute_bits)[c.type[victim]]
    cdef double amount = <double>damage.amount, bonus = 0.0, more
    cdef bint fits = False
    for bit, value in <tuple>damage.bonus:
        if attributes & <int64_t>bit:
            more = value
            bonus = most(bonus, more) if fits else more
            fits = True
    amount = (amount + bonus) * fraction
    if source != NOBODY:
        if c.bonus_bits[source] & attributes:
            amount += c.bonus_add[source] * fraction
        amount *= c.dealt_factor[source]
    apply_damage(world, c, source, shot.owner, victim, amount, SPLASH if fraction < 1.0 else hit.kind, hit.ignores_armor)


cdef apply_damage(
    object world, Columns c, int64_t source, int64_t owner, int64_t victim, double amount, Kind kind, bint ignores_armor
):
    """Take an amount of damage from one unit: shields first, then life; both players' scores count it."""
    cdef double answer, held, shield_armor = 0.0, armor = 0.0, smallest, absorbed = 0.0, rest, reduced, wounded = 0.0
    cdef int64_t side, at
    if not c.targetable[victim] or c.life[victim] <= 0.0 or amount <= 0.0:
        return
    side = c.owner[victim]
    if kind == RANGED or kind == MELEE:
        answer = c.ranged_add[victim] if kind == RANGED else c.melee_add[victim]
        if answer != 0.0:
            amount = most(amount + answer, DAMAGE_MIN)
    amount *= c.taken_factor[victim]
    if source != NOBODY and kind != SPELL and c.plane_bits[source] & AIR_PLANE:
        amount *= c.air_taken_factor[victim]
    if c.barrier[victim] > 0.0:
        held = least(c.barrier[victim], amount)
        c.barrier[victim] -= held
        amount -= held
    if not ignores_armor:
        numbers = world.stats
        at = side * cnp.PyArray_DIM(<cnp.ndarray>numbers.armor, 1) + c.type[victim]
        shield_armor = floats(numbers.shield_armor)[at] + c.shield_armor_add[victim]
        armor = floats(numbers.armor)[at] + c.armor_add[victim]
    smallest = DAMAGE_MIN if amount > 0.0 else 0.0
    rest = amount
    if c.shields[victim] > 0.0:
        reduced = most(amount - shield_armor, smallest)
        absorbed = least(c.shields[victim], reduced)
        rest = most(least(reduced, amount) - absorbed, 0.0)
    if rest > 0.0:
        wounded = least(c.life[victim], most(rest - armor, smallest))
    c.shields[victim] -= absorbed
    c.life[victim] -= wounded
    c.damaged_loop[victim] = world.loop
    tally(world.players[side].score.damage_taken, absorbed, wounded)
    if owner != side:
        tally(world.players[owner].score.damage_dealt, absorbed, wounded)
    if source != NOBODY:
        c.attacker[victim] = source
        (<list>world.hurt).append((victim, source))


cdef tally(object vitals, double absorbed, double wounded):
    """Count damage to shields and life."""
    if absorbed != 0.0:
        vitals.shields = <double>vitals.shields + absorbed
    if wounded != 0.0:
        vitals.life = <double>vitals.life + wounded


cdef splash(object world, Hit* hit, Shot* shot):
    """Damage every unit in the rings around the impact, with the fraction of its innermost ring."""
    cdef Columns c = columns_of(world)
    cdef object live = world.live, damage = damage_of(world, shot)
    cdef int64_t* slots = ints(live)
    cdef int64_t slot
    cdef double x, y, edge, radius, fraction, arc_deg
    cdef double forward_x = shot.goal.x - shot.start.x, forward_y = shot.goal.y - shot.start.y
    cdef double widest = 0.0
    cdef Py_ssize_t i
    cdef list rings = [(ring.radius, ring.fraction, ring.arc_deg) for ring in damage.hit.area]
    for radius, _, _ in rings:
        widest = most(widest, radius)
    for i in range(count(live)):
        slot = slots[i]
        if not touches(c, &hit.affects, shot, slot):
            continue
        x, y = c.pos[slot].x - shot.goal.x, c.pos[slot].y - shot.goal.y
        edge = length(x, y) - c.radius[slot]
        if edge > widest:
            continue
        for radius, fraction, arc_deg in rings:
            if edge <= radius and (
                arc_deg >= ALL_ROUND_DEG or rules.in_arc(x, y, c.radius[slot], forward_x, forward_y, arc_deg)
            ):
                strike(world, c, hit, shot, slot, damage, fraction)
                break
    if hit.affects.not_target:
        hit_target(world, shot)


cdef bint touches(Columns c, Affects* affects, Shot* shot, int64_t slot) noexcept:
    """Return whether a shot may touch a living unit in passing."""
    if not c.targetable[slot] or not c.life[slot] > 0.0:
        return False
    if not affects.allies and c.owner[slot] == shot.owner or not affects.neutral and c.owner[slot] == 0:
        return False
    if affects.only_structures and not c.walled[slot] or affects.no_structures and c.walled[slot]:
        return False
    if affects.not_self and slot == shot.source or affects.not_target and slot == shot.target:
        return False
    return affects.planes == ANY_PLANE or c.plane_bits[slot] & affects.planes != 0
