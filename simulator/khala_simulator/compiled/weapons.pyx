"""Weapons, compiled; `systems.weapons` has the rules, and the branches of hits that are not always dealt."""
cimport numpy as cnp
from libc.stdint cimport int64_t
from libc.stdlib cimport calloc, free, malloc

from khala_simulator.compiled.columns cimport Columns, Point, boolean, columns_of
from khala_simulator.compiled.numbers cimport count, floats, ints, new_floats, new_ints
from khala_simulator.compiled.shots cimport PendingHit, append
from khala_simulator.compiled.tables cimport Hit, Tables, Weapon, tables_of
from khala_simulator.compiled.turning cimport turned

from khala_simulator.combat.launchers import LAUNCHERS
from khala_simulator.systems import weapons as rules
from khala_simulator.world.census import census

cnp.import_array()

cdef int64_t NOBODY = -1
cdef double NOT_STARTED = rules.NOT_STARTED


def fire(world):
    """Start attacks, carry out those whose damage point has come, and count down."""
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t n = world.top, slot, effective = 0
    cdef bint lost = False
    cdef boolean* started = <boolean*>calloc(n, sizeof(boolean))
    if started == NULL:
        raise MemoryError
    for slot in range(n):
        c.cooldown[slot] -= c.cooldown[slot] > 0.0
        c.backswing[slot] -= c.backswing[slot] > 0.0
        if c.windup[slot] >= 0.0:
            started[slot] = True
            c.windup[slot] -= 1.0
            if not c.in_reach[slot]:  # the target got away before the damage point; that leaves no cooldown
                c.windup[slot] = NOT_STARTED
                c.cooldown[slot] = 0.0
                lost = True
    if lost:
        world.scan_now = True
    try:
        if len(world.fighters):
            start_attacks(world, c, started)
            for slot in range(n):
                effective += c.windup[slot] <= 0.0 and c.windup[slot] > NOT_STARTED
            if effective:
                take_effect(world, c, n, effective)
                c = columns_of(world)
    finally:
        free(started)
    for slot in range(n):
        if c.cooldown[slot] < 0.0:
            c.cooldown[slot] = 0.0  # a fraction is carried over only into the very next attack


cdef start_attacks(world, Columns c, boolean* started):
    """Turn turrets, and begin the attacks of units that are ready and aim at what they reach."""
    cdef object fighters = world.fighters
    cdef int64_t* slots = ints(fighters)
    cdef bint turrets = census(world).turrets
    cdef Tables tables = tables_of(world)
    cdef double* period = floats(world.stats.period)
    cdef Weapon* weapon
    cdef int64_t slot, row
    cdef double delay
    cdef Py_ssize_t i
    for i in range(count(fighters)):
        slot = slots[i]
        if turrets and c.turreted[slot]:
            c.turret[slot] = turned(c.turret[slot], c.toward[slot], c.turret_cos[slot], c.turret_sin[slot])
        if not c.in_reach[slot] or c.cooldown[slot] > 0.0 or started[slot] or not aimed(c, slot):
            continue
        weapon = tables.weapon(weapon_at_hand(c, slot))
        row = weapon - tables.weapons
        delay = 0.0
        if not weapon.beam:
            delay = weapon.delay + weapon.delay_more * <double>world.rng.random()
        c.cooldown[slot] += period[c.owner[slot] * tables.weapon_count + row] / c.attack_rate[slot] + delay
        c.windup[slot] = weapon.damage_point / c.attack_rate[slot]


cdef bint aimed(Columns c, int64_t slot) noexcept:
    """Return whether a unit's body, or its turret, faces its target within the weapon's arc."""
    if c.aim_cos[slot] <= -1.0:
        return True
    cdef Point facing = c.turret[slot] if c.turreted[slot] else c.heading[slot]
    return c.toward[slot].x * facing.x + c.toward[slot].y * facing.y >= c.aim_cos[slot]


cdef int64_t weapon_at_hand(Columns c, int64_t slot) noexcept:
    """Return the row of the weapon for this attack: the one for close targets when the target stands that close."""
    cdef int64_t near = c.close_weapon[slot]
    if near >= 0 and (c.weapon[slot] == near or c.weapon[slot] == c.ground_weapon[slot]):
        c.weapon[slot] = near if c.gap[slot] <= c.close_range[slot] else c.ground_weapon[slot]
    return c.weapon[slot]


cdef take_effect(world, Columns c, Py_ssize_t n, Py_ssize_t effective):
    """Put the hits of finished attacks into ``pending``, weapon by weapon in the order of their first user."""
    cdef Tables tables = tables_of(world)
    cdef cnp.ndarray attackers = new_ints(effective), users = new_ints(effective), rows = new_ints(effective)
    cdef cnp.ndarray moments = new_floats(2 * effective)
    cdef int64_t* slots = ints(attackers)
    cdef int64_t* mine = ints(users)
    cdef int64_t* row_of = ints(rows)
    cdef double* moment_of = floats(moments)
    cdef double* moment = moment_of + effective
    cdef PendingHit* laid
    cdef Weapon* weapon
    cdef Py_ssize_t slot, i, k, other, index, hits = 0, most_hits = 1
    cdef int64_t loop = world.loop
    i = 0
    for slot in range(n):
        if c.windup[slot] <= 0.0 and c.windup[slot] > NOT_STARTED:
            slots[i], row_of[i], moment_of[i] = slot, c.weapon[slot], loop + c.windup[slot]
            most_hits += tables.weapon(c.weapon[slot]).hits
            i += 1
    laid = <PendingHit*>malloc(most_hits * sizeof(PendingHit))
    if laid == NULL:
        raise MemoryError
    try:
        for i in range(effective):
            if first_of(row_of, row_of[i]) < i:
                continue
            weapon = tables.weapon(row_of[i])
            k = 0
            for other in range(i, effective):
                if row_of[other] == row_of[i]:
                    mine[k], moment[k] = slots[other], moment_of[other]
                    k += 1
            for index in range(weapon.hits):
                hits = lay(world, c, tables, weapon, index, mine, moment, k, laid, hits)
            for other in range(k):
                c.backswing[mine[other]] = weapon.backswing
                c.beaming[mine[other]] = weapon.beam
            if weapon.launches:
                if hits:
                    append(world.pending, laid, hits)
                    hits = 0
                launch(world, world.catalog.weapons[row_of[i]].id, mine, k)
                c = columns_of(world)
        if hits:
            append(world.pending, laid, hits)
    finally:
        free(laid)
    for i in range(effective):
        c.windup[slots[i]] = NOT_STARTED


cdef launch(world, str weapon, int64_t* slots, Py_ssize_t users):
    """Send out what a weapon launches instead of hitting."""
    launcher = LAUNCHERS[weapon]
    cdef Py_ssize_t i
    for i in range(users):
        launcher(world, slots[i], columns_of(world).target[slots[i]])


cdef Py_ssize_t first_of(int64_t* row_of, int64_t row) noexcept:
    """Return the first place of a row that is there."""
    cdef Py_ssize_t i = 0
    while row_of[i] != row:
        i += 1
    return i


cdef Py_ssize_t lay(
    world, Columns c, Tables tables, Weapon* weapon, Py_ssize_t index, int64_t* slots, double* moment, Py_ssize_t users,
    PendingHit* laid, Py_ssize_t hits,
) except -1:
    """Lay one hit of a weapon's attacks behind those that are laid; return how many there are then."""
    cdef Hit* hit = &tables.hits[weapon.first_hit + index]
    cdef int64_t slot, target, at
    cdef Py_ssize_t i
    cdef PendingHit* new
    cdef boolean* chosen = NULL
    if hit.bounces:  # these follow from the hit before
        return hits
    if hit.conditional:
        taken = branch(world, c, weapon - tables.weapons, index, slots, users)
        chosen = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>taken)
    for i in range(users):
        if chosen != NULL and not chosen[i]:
            continue
        slot = slots[i]
        target = c.target[slot]
        at = slot if weapon.kamikaze else target  # a suicide attacker is the middle of it
        new = &laid[hits]
        new.shot.source, new.shot.owner, new.shot.target, new.shot.prior = slot, c.owner[slot], target, NOBODY
        new.shot.weapon, new.shot.hit = weapon - tables.weapons, index
        new.shot.start, new.shot.goal = c.pos[slot], c.pos[at if at >= 0 else at + c.capacity]
        new.due, new.single = moment[i] + hit.delay, False
        hits += 1
    return hits


cdef object branch(world, Columns c, Py_ssize_t row, Py_ssize_t index, int64_t* slots, Py_ssize_t users):
    """Return (users,) whether the game's switch takes the branch of a hit."""
    cdef cnp.ndarray sources = new_ints(users), targets = new_ints(users)
    cdef Py_ssize_t i
    for i in range(users):
        ints(sources)[i], ints(targets)[i] = slots[i], c.target[slots[i]]
    weapon = world.catalog.weapons[row]
    return rules.branch(world, weapon.hits[index], weapon, sources, targets)
