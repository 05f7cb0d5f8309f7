"""Acquiring, compiled; `systems.acquire` has the rules, and who flees."""
cimport numpy as cnp
from libc.math cimport sqrt
from libc.stdint cimport int64_t
from libc.stdlib cimport free, malloc

from khala_simulator.compiled.columns cimport Columns, columns_of
from khala_simulator.compiled.numbers cimport count, floats, ints, least, most, new_ints
from khala_simulator.compiled.tables cimport Tables, tables_of
from khala_simulator.compiled.targets cimport disengage, engage, inside_zone

from khala_simulator.systems import acquire as rules
from khala_simulator.tables import stats
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.census import census

cnp.import_array()

cdef int64_t NOBODY = -1
cdef int64_t GROUND_PLANE = stats.GROUND_PLANE
cdef int64_t AIR_PLANE = stats.AIR_PLANE
cdef int64_t IDLE = rules.IDLE
cdef int64_t ATTACK_MOVE = rules.ATTACK_MOVE
cdef int64_t PATROL = rules.PATROL
cdef double PRIORITY_WEIGHT = rules.PRIORITY_WEIGHT
cdef double THREAT_WEIGHT = rules.THREAT_WEIGHT
cdef double TOP_RANK = rules.TOP_RANK
cdef double RANK_STEP = rules.RANK_STEP
cdef double OUT_OF_SIGHT = rules.OUT_OF_SIGHT
cdef double LEASH_RADIUS_SQUARED = MECHANICS.leash_radius**2
cdef double LEASH_RESET_SQUARED = MECHANICS.leash_reset**2
cdef double HELP_RADIUS_SQUARED = MECHANICS.help_radius**2
cdef double SWITCH_GAIN = MECHANICS.switch_gain
cdef int64_t SCAN_PERIOD = MECHANICS.scan_period
cdef int64_t LOOK_UP_PERIOD = MECHANICS.look_up_period
cdef int64_t HELP_PERIOD = MECHANICS.help_period
cdef double ROUNDING = 1e-6  # more than roundings make of a distance on any map

cdef struct Foe:
    double x
    double y
    double radius
    double rank  # by its priority
    int64_t planes  # where it is
    int64_t threatens  # planes
    int64_t slot

cdef struct Choice:
    int64_t seeker
    int64_t foe
    double gap  # between the edges
    double worth


def choose_targets(world):
    """Answer attacks, give up lost targets, and look for targets with the units that are due."""
    cdef Columns c = columns_of(world)
    if world.hurt:
        answer(world, c)
    cdef int64_t loop = world.loop
    if not world.scan_now and loop % SCAN_PERIOD:
        return
    world.scan_now = False
    cdef Py_ssize_t n = world.top, seeking = 0, slot, i
    cdef cnp.ndarray seekers = new_ints(n)
    cdef int64_t* slots = ints(seekers)
    cdef bint looks_up = loop % LOOK_UP_PERIOD == 0, freed = False
    for slot in range(n):
        if c.leashed[slot]:
            slip_leash(c, slot)
        if is_due(c, slot, loop, looks_up):
            slots[seeking] = slot
            seeking += 1
    if not seeking:
        return
    for i in range(seeking):
        slot = slots[i]
        if c.target[slot] != NOBODY and gives_up(c, slot):
            disengage(c, slot)
            freed = True
        c.scan_loop[slot] = loop + SCAN_PERIOD - loop % SCAN_PERIOD
    if freed:
        world.scan_now = True
    for player in range(1, len(world.players)):
        seek(world, c, player, slots, seeking)


cdef bint is_due(Columns c, Py_ssize_t slot, int64_t loop, bint looks_up) noexcept:
    """Return whether a unit looks for a target now: the best one there is, if it has one in reach, rarely."""
    if not (c.looks_around[slot] or c.guns_walking[slot] and c.walks[slot]):
        return False
    if not c.acquires[slot] or c.scan_loop[slot] > loop or not c.windup[slot] < 0.0 or c.leashed[slot]:
        return False
    if c.defensive[slot] and not seeks_fights(c, slot):
        return False
    return not (c.in_reach[slot] and c.target[slot] != NOBODY and (not looks_up or c.rank[slot] >= TOP_RANK))


cdef bint seeks_fights(Columns c, int64_t slot) noexcept:
    """Return whether a worker with this order picks fights by itself."""
    return c.order_kind[slot] == ATTACK_MOVE or c.order_kind[slot] == PATROL


cdef bint stays(Columns c, int64_t slot) noexcept:
    """Return whether a unit chases no target: it holds its place, or fires only at what it passes."""
    return c.holds[slot] or not c.looks_around[slot]


cdef double from_guard(Columns c, int64_t slot) noexcept:
    """Return the square of a unit's distance from where it stood before a fight."""
    cdef double x = c.pos[slot].x - c.guard[slot].x, y = c.pos[slot].y - c.guard[slot].y
    return x * x + y * y


cdef bint gives_up(Columns c, int64_t slot) noexcept:
    """Return whether a unit drops its target, which led it too far, that it stays away from, or that it can't see."""
    c.leashed[slot] = c.order_kind[slot] == IDLE and from_guard(c, slot) > LEASH_RADIUS_SQUARED
    return (
        c.leashed[slot]
        or stays(c, slot) and not c.in_reach[slot]
        or not c.visible[c.owner[slot] * c.capacity + c.target[slot]]
    )


cdef void slip_leash(Columns c, int64_t slot) noexcept:
    """End the leash of a unit that gave up a chase when it is nearly back, or has another order."""
    c.leashed[slot] = (
        from_guard(c, slot) > LEASH_RESET_SQUARED and c.order_kind[slot] == IDLE and c.returning[slot]
    )


cdef seek(world, Columns c, int64_t player, int64_t* slots, Py_ssize_t seeking):
    """Give each seeker of a player the best target it can see, if that is better than what it has."""
    cdef object live = world.live
    cdef Py_ssize_t chosen = 0, mine = 0, foe_count, i
    cdef Tables tables = tables_of(world)
    cdef double* ranges
    cdef bint filters, zones
    cdef double widest = 0.0  # of the foes' bodies
    for i in range(seeking):
        mine += c.owner[slots[i]] == player
    if not mine:
        return
    cdef Foe* foes = <Foe*>malloc(count(live) * sizeof(Foe) + 1)
    cdef Choice* choices = <Choice*>malloc(mine * sizeof(Choice))
    try:
        if foes == NULL or choices == NULL:
            raise MemoryError
        foe_count = foes_of(c, player, ints(live), count(live), foes)
        if not foe_count:
            return
        for i in range(foe_count):
            widest = most(widest, foes[i].radius)
        ranges = floats(world.stats.range) + player * tables.weapon_count
        filters, zones = census(world).weapons_with_filters, bool(world.area_effects)
        for i in range(seeking):
            if c.owner[slots[i]] == player:
                choices[chosen].seeker = slots[i]
                if better(c, tables, ranges, foes, foe_count, widest, filters, zones, &choices[chosen]):
                    chosen += 1
        for i in range(chosen):
            take(world, c, choices[i].seeker, choices[i].foe)
            c.rank[choices[i].seeker] = choices[i].worth + choices[i].gap
    finally:
        free(foes)
        free(choices)


cdef Py_ssize_t foes_of(Columns c, int64_t player, int64_t* live, Py_ssize_t units, Foe* foes) noexcept:
    """Write the enemies of a player that it sees and can aim at; return how many."""
    cdef Py_ssize_t found = 0, i
    cdef int64_t slot
    for i in range(units):
        slot = live[i]
        if is_foe(c, player, slot):
            foes[found].slot = slot
            foes[found].x, foes[found].y, foes[found].radius = c.pos[slot].x, c.pos[slot].y, c.radius[slot]
            foes[found].planes = c.plane_bits[slot]
            foes[found].rank = c.priority[slot] * PRIORITY_WEIGHT
            foes[found].threatens = threatened_planes(c, slot)
            found += 1
    return found


cdef bint is_foe(Columns c, int64_t player, int64_t slot) noexcept:
    """Return whether a unit is an enemy of a player that it sees and can aim at."""
    return (
        c.owner[slot] != player and c.owner[slot] != 0
        and c.targetable[slot] and c.visible[player * c.capacity + slot]
    )


cdef double rank_of(Columns c, int64_t seeker, int64_t foe) noexcept:
    """Return the rank that comes before distance: the foe's priority, and whether it threatens its seeker."""
    cdef double threat = THREAT_WEIGHT if threatened_planes(c, foe) & c.plane_bits[seeker] else 0.0
    return c.priority[foe] * PRIORITY_WEIGHT + threat


cdef int64_t threatened_planes(Columns c, int64_t foe) noexcept:
    """Return the planes that a foe threatens; workers are no threat as long as they do not fight."""
    return 0 if c.defensive[foe] and c.target[foe] == NOBODY else c.threat_bits[foe]


cdef bint better(
    Columns c, Tables tables, double* ranges, Foe* foes, Py_ssize_t foe_count, double widest, bint filters, bint zones,
    Choice* choice,
) noexcept:
    """Write the best target of a seeker and what its present one is worth; return whether the best one is better."""
    cdef int64_t slot = choice.seeker, now = c.target[slot]
    cdef double rank_now = OUT_OF_SIGHT, rise
    cdef bint handy
    if now != NOBODY:
        rank_now = rank_of(c, slot, now)
    c.rank[slot] = rank_now
    if not best_of(c, tables, ranges, foes, foe_count, widest, filters, zones, choice) or choice.foe == now:
        return False
    rise = choice.worth + choice.gap - rank_now
    if rise > RANK_STEP:
        return True
    if not rise > -RANK_STEP or c.in_reach[slot]:
        return False
    return c.gap[slot] - choice.gap > SWITCH_GAIN or reaches(c, tables, ranges, slot, choice.foe, choice.gap)


cdef bint best_of(
    Columns c, Tables tables, double* ranges, Foe* foes, Py_ssize_t foe_count, double widest, bint filters, bint zones,
    Choice* choice,
) noexcept:
    """Write the foe that is worth most to a seeker, the first one of several; return whether there is any in sight."""
    cdef int64_t slot = choice.seeker, planes = c.plane_bits[slot], foe
    cdef double on_ground = c.ground_scan[slot], in_air = c.air_scan[slot], longest
    cdef double x = c.pos[slot].x, y = c.pos[slot].y, radius = c.radius[slot]
    cdef double dx, dy, squared, gap, sight, worth, farthest
    cdef Py_ssize_t i
    cdef Foe* other
    if stays(c, slot):
        longest = longest_reach(c, ranges, slot)
        on_ground, in_air = least(on_ground, longest), least(in_air, longest)
    farthest = most(on_ground, in_air) + radius + widest + ROUNDING
    if farthest < 0.0:
        return False
    farthest = farthest * farthest
    choice.worth = OUT_OF_SIGHT
    for i in range(foe_count):
        other = &foes[i]
        dx, dy = x - other.x, y - other.y
        squared = dx * dx + dy * dy
        if squared > farthest:
            continue
        gap = sqrt(squared) - radius - other.radius
        sight = most(on_ground if other.planes & GROUND_PLANE else -1.0, in_air if other.planes & AIR_PLANE else -1.0)
        worth = ((THREAT_WEIGHT if other.threatens & planes else 0.0) + other.rank) - gap
        if gap > sight or worth <= choice.worth:
            continue
        foe = other.slot
        if filters:
            if c.least_range[slot] > 0.0 and gap < c.least_range[slot] or c.spares_structures[slot] and c.walled[foe]:
                continue
        if zones and not inside_zone(c, slot, foe):
            continue
        choice.worth, choice.gap, choice.foe = worth, gap, foe
    return choice.worth > OUT_OF_SIGHT


cdef double longest_reach(Columns c, double* ranges, int64_t slot) noexcept:
    """Return how far the farther of a unit's weapons reaches."""
    cdef double ground = ranges[c.ground_weapon[slot]] if c.ground_weapon[slot] >= 0 else 0.0
    cdef double air = ranges[c.air_weapon[slot]] if c.air_weapon[slot] >= 0 else 0.0
    return most(ground, air) + c.range_add[slot]


cdef bint reaches(Columns c, Tables tables, double* ranges, int64_t slot, int64_t foe, double gap) noexcept:
    """Return whether a unit could fire at a foe from where it stands."""
    cdef bint on_ground = c.plane_bits[foe] & GROUND_PLANE != 0 and c.ground_weapon[slot] >= 0
    cdef int64_t row = c.ground_weapon[slot] if on_ground else c.air_weapon[slot]
    cdef double touch = c.separation[slot] + c.separation[foe] - c.radius[slot] - c.radius[foe]
    return gap <= most(ranges[row if row >= 0 else row + tables.weapon_count] + c.range_add[slot], touch)


cdef take(world, Columns c, int64_t slot, int64_t target):
    """Start a fight by the unit's own choice; an idle one remembers where it stood."""
    if c.order_kind[slot] == IDLE and c.target[slot] == NOBODY and not c.returning[slot]:
        c.guard[slot] = c.pos[slot]
        c.returning[slot] = True
    c.rank[slot] = OUT_OF_SIGHT  # a scan that found it knows better
    engage(world, c, slot, target)


cdef answer(world, Columns c):
    """Turn attacked units on their attackers, and call their idle friends."""
    cdef int64_t victim, attacker, friend, loop = world.loop
    cdef object live = world.live
    cdef int64_t* slots = ints(live)
    cdef double dx, dy
    cdef Py_ssize_t i
    hurt, world.hurt = world.hurt, []
    for victim, attacker in hurt:
        if not (c.alive[victim] and c.alive[attacker]) or c.owner[victim] == c.owner[attacker]:
            continue
        turn_on(world, c, victim, attacker)
        if loop - c.help_loop[victim] >= HELP_PERIOD:
            c.help_loop[victim] = loop
            for i in range(count(live)):
                friend = slots[i]
                if c.owner[friend] != c.owner[victim] or friend == victim:
                    continue
                dx, dy = c.pos[friend].x - c.pos[victim].x, c.pos[friend].y - c.pos[victim].y
                if dx * dx + dy * dy <= HELP_RADIUS_SQUARED:
                    turn_on(world, c, friend, attacker)
        if c.flees[victim] and c.order_kind[victim] == IDLE and not c.returning[victim]:
            rules.flee(world, victim, attacker)


cdef turn_on(world, Columns c, int64_t slot, int64_t attacker):
    """Make a unit that is free to do so fight an attacker that it sees."""
    if (
        c.looks_around[slot] and not (c.holds[slot] or c.leashed[slot]) and c.step_max[slot] > 0.0
        and c.acquires[slot] and c.target[slot] == NOBODY and (not c.defensive[slot] or seeks_fights(c, slot))
        and c.visible[c.owner[slot] * c.capacity + attacker]
    ):
        take(world, c, slot, attacker)
