"""Vision, compiled; `systems.vision` has the rules, and lights, detectors and revealing buffs; `combat.fog` remembers."""
cimport numpy as cnp
from libc.stdint cimport int16_t, int64_t, uint8_t, uint16_t
from libc.string cimport memcmp, memcpy, memset

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.compiled.numbers cimport count, floats, ints, new_ints

import numpy as np

from khala_simulator.combat import fog
from khala_simulator.systems import vision as rules
from khala_simulator.tables.mechanics import MECHANICS

cnp.import_array()

cdef int64_t AIR = rules.AIR
cdef int64_t FROM_ABOVE = rules.FROM_ABOVE
cdef uint8_t SEEN_BEFORE = rules.SEEN_BEFORE
cdef uint8_t VISIBLE = rules.VISIBLE
cdef int64_t VISION_PERIOD = MECHANICS.vision_period
cdef double HIGH_GROUND_STEP = MECHANICS.high_ground_step

cdef struct Grid:
    int64_t width
    int64_t height

cdef struct Eye:
    int64_t owner
    int64_t x
    int64_t y
    double radius
    int64_t below  # the cliff level from which on it does not see


def look(world):
    """Update ``visibility`` and ``visible``; where there is fog or a unit hides, every few loops."""
    cdef bint changed = world.looked_at != world.population, fogged = world.fog
    cdef bint due = changed or <int64_t>world.loop % VISION_PERIOD == 0
    if not (fogged or changed or world.hiding and due):
        return
    if fogged and due:
        light(world)
    see_units(world, columns_of(world), fogged)
    if len(world.buffs):
        rules.reveal(world)
    if fogged and due:
        for player in range(1, len(world.players)):
            if must_remember(world, player):
                fog.remember(world, player)
    world.looked_at = world.population


cdef Grid grid_of(object cells):
    """Return the size of an array (..., h, w) of cells."""
    cdef Grid grid
    cdef int last = cnp.PyArray_NDIM(<cnp.ndarray>cells) - 1
    grid.width, grid.height = cnp.PyArray_DIM(<cnp.ndarray>cells, last), cnp.PyArray_DIM(<cnp.ndarray>cells, last - 1)
    return grid


cdef int64_t cell_of(Grid* grid, Point point) noexcept:
    """Return the number of the cell that a point is in, or of the nearest one on the map."""
    cdef int64_t x = <int64_t>point.x, y = <int64_t>point.y
    x = 0 if x < 0 else grid.width - 1 if x >= grid.width else x
    y = 0 if y < 0 else grid.height - 1 if y >= grid.height else y
    return y * grid.width + x


cdef see_units(object world, Columns c, bint fogged):
    """Write which living units each player sees."""
    cdef object live = world.live, visibility = world.visibility
    cdef int64_t* slots = ints(live)
    cdef uint8_t* cells = <uint8_t*>cnp.PyArray_DATA(<cnp.ndarray>visibility)
    cdef Grid grid = grid_of(visibility)
    cdef Py_ssize_t players = len(world.players), top = world.top, player, i
    cdef int64_t slot, cell
    cdef bint hidden = False
    for player in range(players):
        memset(&c.visible[player * c.capacity], 0, top)
    for i in range(count(live)):
        slot = slots[i]
        cell = cell_of(&grid, c.pos[slot])
        hidden |= c.cloaked[slot] != 0
        for player in range(players):
            c.visible[player * c.capacity + slot] = (
                not fogged or c.owner[slot] == player or cells[player * grid.width * grid.height + cell] == VISIBLE
            )
    if hidden and world.hiding:
        hide(world, c, slots, count(live), players)


cdef hide(object world, Columns c, int64_t* slots, Py_ssize_t n, Py_ssize_t players):
    """Take cloaked units from the sight of players that do not detect them."""
    cdef Py_ssize_t hidden = 0, i, player
    cdef cnp.ndarray cloaked
    cdef int64_t slot
    for i in range(n):
        hidden += c.cloaked[slots[i]] != 0
    cloaked = new_ints(hidden)
    hidden = 0
    for i in range(n):
        if c.cloaked[slots[i]]:
            ints(cloaked)[hidden] = slots[i]
            hidden += 1
    for player in range(players):
        detected = rules.detected(world, player, cloaked)
        for i in range(hidden):
            slot = ints(cloaked)[i]
            if c.owner[slot] != player and not (<boolean*>cnp.PyArray_DATA(<cnp.ndarray>detected))[i]:
                c.visible[player * c.capacity + slot] = False


# light ----------------------------------------------------------------------------------------------------------------


cdef light(object world):
    """Redraw every player's visibility grid."""
    cdef object visibility = world.visibility, eyes = world.eyes
    if not isinstance(eyes, rules.Eyes):
        eyes = world.eyes = rules.Eyes(np.zeros((5, 0)), set(), np.zeros(visibility.shape, dtype=np.int16))
    count_units(world, columns_of(world), eyes)
    if world.area_effects or len(world.buffs) or eyes.lights:
        rules.count_lights(world, eyes)
    cdef Grid grid = grid_of(visibility)
    cdef Py_ssize_t cells = grid.width * grid.height, all_cells = cells * count(visibility), cell
    cdef uint8_t* seen = <uint8_t*>cnp.PyArray_DATA(<cnp.ndarray>visibility)
    cdef int16_t* watched = <int16_t*>cnp.PyArray_DATA(<cnp.ndarray>eyes.count)
    for cell in range(cells, all_cells):  # the neutral player sees nothing
        seen[cell] = VISIBLE if watched[cell] > 0 else SEEN_BEFORE if seen[cell] > SEEN_BEFORE else seen[cell]
    for player in world.players[1:]:
        if "show_map" in player.cheats:
            visibility[player.id] = VISIBLE


cdef count_units(object world, Columns c, object eyes):
    """Count what the eyes of units see; only those that differ from the last time."""
    cdef object old = eyes.units, cliff = world.map.terrain.cliff, watched = eyes.count, live = world.live
    cdef Py_ssize_t top = world.top, known = cnp.PyArray_DIM(<cnp.ndarray>old, 1), slot, i
    cdef int64_t* slots = ints(live)
    cdef Grid grid = grid_of(cliff)
    new = np.zeros((5, top))
    cdef double* before = floats(old)
    cdef double* now = floats(new)
    cdef Eye was, sees
    cdef Eye nobody
    memset(&nobody, 0, sizeof(Eye))
    for i in range(count(live)):
        slot = slots[i]
        write_eye(c, &grid, <uint16_t*>cnp.PyArray_DATA(<cnp.ndarray>cliff), slot, now, top)
    for slot in range(top):
        was = read_eye(before, known, slot) if slot < known else nobody
        sees = read_eye(now, top, slot)
        if memcmp(&was, &sees, sizeof(Eye)) != 0:
            watch(watched, cliff, &was, -1)
            watch(watched, cliff, &sees, 1)
    eyes.units = new


cdef void write_eye(Columns c, Grid* grid, uint16_t* cliff, int64_t slot, double* eyes, Py_ssize_t top) noexcept:
    """Write the eye of a living unit into a table (5, slots)."""
    eyes[slot] = c.owner[slot]
    eyes[top + slot], eyes[2 * top + slot] = <int64_t>c.pos[slot].x, <int64_t>c.pos[slot].y
    eyes[3 * top + slot] = c.sight[slot]
    eyes[4 * top + slot] = FROM_ABOVE if c.layer[slot] == AIR else cliff[cell_of(grid, c.pos[slot])] + HIGH_GROUND_STEP


cdef Eye read_eye(double* eyes, Py_ssize_t top, Py_ssize_t slot) noexcept:
    """Return an eye from a table (5, slots)."""
    cdef Eye eye
    eye.owner, eye.x, eye.y = <int64_t>eyes[slot], <int64_t>eyes[top + slot], <int64_t>eyes[2 * top + slot]
    eye.radius, eye.below = eyes[3 * top + slot], <int64_t>eyes[4 * top + slot]
    return eye


cdef watch(object watched, object cliff, Eye* eye, int16_t sign):
    """Add every cell that an eye sees, or take it away."""
    if not eye.owner:
        return
    shape, size = rules.disc(eye.radius)
    cdef boolean* disc = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>shape)
    cdef uint16_t* levels = <uint16_t*>cnp.PyArray_DATA(<cnp.ndarray>cliff)
    cdef Grid grid = grid_of(cliff)
    cdef int16_t* cells = <int16_t*>cnp.PyArray_DATA(<cnp.ndarray>watched) + eye.owner * grid.width * grid.height
    cdef int64_t half = size, x, y, cell
    for y in range(max(eye.y - half, 0), min(eye.y + half + 1, grid.height)):
        for x in range(max(eye.x - half, 0), min(eye.x + half + 1, grid.width)):
            cell = y * grid.width + x
            if disc[(y - eye.y + half) * (2 * half + 1) + x - eye.x + half] and levels[cell] < eye.below:
                cells[cell] += sign


# memory ---------------------------------------------------------------------------------------------------------------


cdef bint must_remember(object world, int64_t player) except -1:
    """Return whether a player's memory changes: something in sight is not as it was noted, or a snapshot is in sight."""
    cdef Columns c = columns_of(world)
    cdef object memory = world.memories[player], live = world.live, cells = memory.cells, visibility = world.visibility
    cdef object stays = fog.leave_snapshots(world.catalog)
    cdef boolean* leaves = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>stays)
    cdef int64_t* slots = ints(live)
    cdef Py_ssize_t seen = 0, i
    cdef int64_t slot
    cdef Grid grid = grid_of(visibility)
    cdef uint8_t* sees = <uint8_t*>cnp.PyArray_DATA(<cnp.ndarray>visibility) + player * grid.width * grid.height
    if memory.noted is None or not memory.made:
        return True
    for i in range(count(cells)):
        if sees[ints(cells)[i]] == VISIBLE:
            return True
    cdef cnp.ndarray shown = new_ints(count(live))
    for i in range(count(live)):
        slot = slots[i]
        if leaves[c.type[slot]] and c.owner[slot] != player and c.visible[player * c.capacity + slot]:
            ints(shown)[seen] = slot
            seen += 1
    return not is_noted(c, ints(shown), seen, memory.noted)


cdef bint is_noted(Columns c, int64_t* slots, Py_ssize_t seen, bytes noted) noexcept:
    """Return whether units are as they were noted: tags, types, owners, places, headings and progress."""
    if len(noted) != seen * (4 * sizeof(double) + 2 * sizeof(Point)):
        return False
    cdef int64_t* tag = <int64_t*><char*>noted
    cdef int64_t* type = tag + seen
    cdef int64_t* owner = type + seen
    cdef Point* pos = <Point*>(owner + seen)
    cdef Point* heading = pos + seen
    cdef double* progress = <double*>(heading + seen)
    cdef Py_ssize_t i
    cdef int64_t slot
    for i in range(seen):
        slot = slots[i]
        if tag[i] != c.tag[slot] or type[i] != c.type[slot] or owner[i] != c.owner[slot]:
            return False
        if memcmp(&pos[i], &c.pos[slot], sizeof(Point)) or memcmp(&heading[i], &c.heading[slot], sizeof(Point)):
            return False
        if memcmp(&progress[i], &c.build_progress[slot], sizeof(double)):
            return False
    return True
