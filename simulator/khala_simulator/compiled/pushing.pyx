"""How bodies push each other apart, compiled; `systems.collision` has the rules."""
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns
from khala_simulator.native.memory cimport Point
from khala_simulator.compiled.contacts cimport Crowd, Pair
from khala_simulator.compiled.numbers cimport least, length, most

from khala_simulator.movement import contacts
from khala_simulator.systems import collision as rules
from khala_simulator.tables.mechanics import MECHANICS

cdef int64_t NOBODY = -1
cdef double OVERLAP_ALLOWED = contacts.OVERLAP_ALLOWED
cdef double OVERLAP_PRESSED = rules.OVERLAP_PRESSED
cdef int64_t AIR = rules.AIR
cdef double SAME_POINT = rules.SAME_POINT
cdef double STIR = rules.STIR
cdef double IMMOBILE_YIELDING = rules.IMMOBILE_YIELDING
cdef double EVEN = rules.EVEN
cdef double PUSH_FIRM = MECHANICS.push_firm
cdef double PUSH_IDLE = MECHANICS.push_idle
cdef double PUSH_AHEAD = MECHANICS.push_ahead
cdef double PUSH_LIMIT = MECHANICS.push_limit
cdef int PUSH_ROUNDS = MECHANICS.push_rounds
cdef double FLYER_DRIFT = MECHANICS.flyer_drift
cdef double FLYER_DRIFT_LIMIT = MECHANICS.flyer_drift_limit
cdef Point[8] EIGHT_DIRECTIONS
for _i in range(8):
    EIGHT_DIRECTIONS[_i].x, EIGHT_DIRECTIONS[_i].y = rules.EIGHT_DIRECTIONS[_i]


cdef bint push_apart(Crowd crowd, Columns c, int64_t* slots) except -1:
    """Move overlapping bodies apart; return whether any body was touched."""
    if not crowd.near(c, slots):
        return False
    cdef Py_ssize_t i
    cdef bint drifting = False, limited = False
    cdef double far
    cdef Point* after = crowd.after
    cdef Point* start = crowd.start
    if crowd.closest < SAME_POINT:
        part(crowd)
    for i in range(crowd.count):
        start[i] = after[i]
    drifting = drift_apart(crowd, c, slots)
    if crowd.many:
        share_out(crowd, c, slots)
        relax(crowd, PUSH_ROUNDS)
        if step_back(crowd):
            relax(crowd, PUSH_ROUNDS - 1)
    for i in range(crowd.count):
        limited |= length(after[i].x - start[i].x, after[i].y - start[i].y) > PUSH_LIMIT
    if limited:
        for i in range(crowd.count):
            after[i].x -= start[i].x
            after[i].y -= start[i].y
            far = least(1.0, PUSH_LIMIT / most(length(after[i].x, after[i].y), 1e-12))
            after[i].x, after[i].y = start[i].x + after[i].x * far, start[i].y + after[i].y * far
    return crowd.many > 0 or drifting


cdef void part(Crowd crowd) noexcept:
    """Give bodies on the very same point a direction to separate in: one of eight, by their numbers."""
    cdef Py_ssize_t i
    cdef Pair* pair
    cdef double x, y
    for i in range(crowd.count):
        crowd.friend[i] = 0.0
    for i in range(crowd.many):
        pair = &crowd.pairs[i]
        x = crowd.after[pair.one].x - crowd.after[pair.other].x
        y = crowd.after[pair.one].y - crowd.after[pair.other].y
        if x * x + y * y < SAME_POINT:
            crowd.friend[pair.one] = crowd.friend[pair.other] = 1.0
    for i in range(crowd.count):
        if crowd.friend[i]:
            crowd.after[i].x += EIGHT_DIRECTIONS[i % 8].x * (1.0 + i) * SAME_POINT * STIR
            crowd.after[i].y += EIGHT_DIRECTIONS[i % 8].y * (1.0 + i) * SAME_POINT * STIR


cdef bint drift_apart(Crowd crowd, Columns c, int64_t* slots) noexcept:
    """Separate flyers that hover over each other little by little, and forget their pairs; return whether any did."""
    cdef Py_ssize_t i, kept = 0
    cdef Pair* pair
    cdef int64_t one, other
    cdef bint drifting = False
    cdef double distance, depth, push
    for i in range(crowd.many):
        pair = &crowd.pairs[i]
        if c.layer[slots[pair.one]] == AIR or c.layer[slots[pair.other]] == AIR:
            pair.x = crowd.after[pair.one].x - crowd.after[pair.other].x
            pair.y = crowd.after[pair.one].y - crowd.after[pair.other].y
        else:
            kept += 1
    if kept == crowd.many:
        return False
    for half in range(1 if crowd.by_slots else 2):
        for i in range(crowd.many):
            pair = &crowd.pairs[i]
            one, other = slots[pair.one], slots[pair.other]
            if c.layer[one] != AIR and c.layer[other] != AIR or c.wants[one] or c.wants[other]:
                continue
            distance = length(pair.x, pair.y)
            depth = most(pair.apart - distance, 0.0)
            push = least(depth * FLYER_DRIFT, FLYER_DRIFT_LIMIT) / most(distance, SAME_POINT)
            if (crowd.by_slots or half == 0) and hovers(c, one):
                crowd.after[pair.one].x += pair.x * push
                crowd.after[pair.one].y += pair.y * push
                drifting |= depth > OVERLAP_ALLOWED
            if (crowd.by_slots or half == 1) and hovers(c, other):
                crowd.after[pair.other].x -= pair.x * push
                crowd.after[pair.other].y -= pair.y * push
                drifting |= depth > OVERLAP_ALLOWED
    kept = 0
    for i in range(crowd.many):
        pair = &crowd.pairs[i]
        if c.layer[slots[pair.one]] != AIR and c.layer[slots[pair.other]] != AIR:
            crowd.pairs[kept] = pair[0]
            kept += 1
    crowd.many = kept
    return drifting


cdef inline bint hovers(Columns c, int64_t slot) noexcept:
    """Return whether a unit that does not want to move gives way to others."""
    return not c.holds[slot] and c.step_max[slot] > 0.0


cdef void share_out(Crowd crowd, Columns c, int64_t* slots) noexcept:
    """Write the shares of an overlap by which the two of each pair give way."""
    cdef Py_ssize_t i
    cdef int64_t slot, one, other
    cdef bint immobile
    cdef double firm, mine, theirs, left_one, left_other
    cdef Pair* pair
    for i in range(crowd.count):
        slot = slots[i]
        immobile = c.step_max[slot] <= 0.0 or c.holds[slot]
        firm = IMMOBILE_YIELDING if immobile else (1.0 if c.wants[slot] else PUSH_FIRM) * c.lightness[slot]
        crowd.enemy[i] = crowd.friend[i] = firm
        if c.target[slot] == NOBODY and not c.wants[slot] and not immobile:
            crowd.friend[i] = PUSH_IDLE * c.lightness[slot]
    for i in range(crowd.many):
        pair = &crowd.pairs[i]
        one, other = slots[pair.one], slots[pair.other]
        if c.owner[one] == c.owner[other]:
            mine, theirs = crowd.friend[pair.one], crowd.friend[pair.other]
        else:
            mine, theirs = crowd.enemy[pair.one], crowd.enemy[pair.other]
        if c.wants[one] and c.wants[other]:
            left_one, left_other = left(c, one), left(c, other)
            if left_other > left_one:
                mine *= PUSH_AHEAD
            elif left_other < left_one:
                theirs *= PUSH_AHEAD
        pair.share, pair.rest = mine / (mine + theirs), theirs / (mine + theirs)


cdef inline double left(Columns c, int64_t slot) noexcept:
    """Return the distance of a unit to its next corner, squared; the nearer unit goes first."""
    cdef double x = c.nav_point[slot].x - c.pos[slot].x, y = c.nav_point[slot].y - c.pos[slot].y
    return x * x + y * y


cdef void relax(Crowd crowd, int rounds) noexcept:
    """Push overlapping pairs apart up to ``rounds`` times, and write how deep they stay in each other."""
    cdef Point* at = crowd.after
    cdef Point* force = crowd.force
    cdef Pair* pair
    cdef Py_ssize_t i, overlapping
    cdef double distance, deepest
    while True:
        overlapping, deepest = 0, 0.0
        for i in range(crowd.many):  # without a branch, as none could be foreseen
            pair = &crowd.pairs[i]
            pair.x, pair.y = at[pair.one].x - at[pair.other].x, at[pair.one].y - at[pair.other].y
            distance = length(pair.x, pair.y)
            pair.depth = pair.apart - distance
            pair.push = pair.depth / (distance if distance > SAME_POINT else SAME_POINT)
            crowd.chosen[overlapping] = i
            overlapping += pair.depth > 0.0
            deepest = pair.depth if pair.depth > deepest else deepest
        if rounds == 0 or not deepest > OVERLAP_ALLOWED:
            return
        rounds -= 1
        for i in range(crowd.count):
            force[i].x = force[i].y = 0.0
        for i in range(overlapping):
            pair = &crowd.pairs[crowd.chosen[i]]
            force[pair.one].x += pair.x * (pair.push * pair.share)
            force[pair.one].y += pair.y * (pair.push * pair.share)
            if crowd.by_slots:
                force[pair.other].x -= pair.x * (pair.push * pair.rest)
                force[pair.other].y -= pair.y * (pair.push * pair.rest)
        if not crowd.by_slots:  # what follows a body in the order of the pairs comes before what it follows
            for i in range(overlapping):
                pair = &crowd.pairs[crowd.chosen[i]]
                force[pair.other].x -= pair.x * (pair.push * pair.rest)
                force[pair.other].y -= pair.y * (pair.push * pair.rest)
        for i in range(crowd.count):
            at[i].x += force[i].x
            at[i].y += force[i].y


cdef bint step_back(Crowd crowd) noexcept:
    """Take back the steps of bodies that stay deep in others; return whether any do."""
    cdef Py_ssize_t i
    cdef Pair* pair
    cdef bint deep = False
    for i in range(crowd.many):
        pair = &crowd.pairs[i]
        if pair.depth > OVERLAP_PRESSED:
            deep = True
            if pair.share >= EVEN:
                crowd.after[pair.one] = crowd.start[pair.one] = crowd.before[pair.one]
            if pair.rest >= EVEN:
                crowd.after[pair.other] = crowd.start[pair.other] = crowd.before[pair.other]
    return deep
