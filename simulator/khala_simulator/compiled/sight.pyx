"""What a player perceives of units, compiled; `api.sight` has the rules, and all that is remembered or planned."""
cimport numpy as cnp
from libc.stdint cimport int32_t, int64_t, uint8_t

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.native.memory cimport boolean
from khala_simulator.compiled.heights cimport Heights
from khala_simulator.compiled.numbers cimport floats, ints, least, most, new_floats, new_ints, new_points

from khala_simulator.api import sight as rules
from khala_simulator.numeric import geometry
from khala_simulator.systems.vision import detected
from khala_simulator.world.orders import OrderKind

cnp.import_array()

cdef int64_t OBSERVER = rules.OBSERVER
cdef int64_t API_NEUTRAL = rules.API_NEUTRAL
cdef int64_t SELF = rules.Alliance.SELF
cdef int64_t NEUTRAL = rules.Alliance.NEUTRAL
cdef int64_t ENEMY = rules.Alliance.ENEMY
cdef int64_t VISIBLE = rules.Display.VISIBLE
cdef int64_t HIDDEN = rules.Display.HIDDEN
cdef int64_t PLACEHOLDER = rules.Display.PLACEHOLDER
cdef int64_t UNKNOWN = rules.Cloak.UNKNOWN
cdef int64_t CLOAKED = rules.Cloak.CLOAKED
cdef int64_t DETECTED = rules.Cloak.DETECTED
cdef int64_t NOT_CLOAKED = rules.Cloak.NOT_CLOAKED
cdef int64_t ALLIED = rules.Cloak.ALLIED
cdef int64_t IDLE = OrderKind.IDLE
cdef uint8_t VISIBLE_CELL = 2


def units_seen(world, types, int64_t player, bint show_cloaked, bint through_fog):
    """Return the units that a player perceives now, as `api.sight.look` does before it adds snapshots."""
    cdef Columns c = columns_of(world)
    cdef cnp.ndarray live = world.live, cells = world.visibility
    if not (cnp.PyArray_ISCARRAY_RO(live) and cnp.PyArray_ISCARRAY_RO(cells)):
        raise ValueError("the list of units and the grid of what is visible must be contiguous")
    cdef Py_ssize_t n = cnp.PyArray_DIM(live, 0), i, k = 0, passes
    cdef int64_t* slots = ints(live)
    cdef int64_t height = cnp.PyArray_DIM(cells, 1), width = cnp.PyArray_DIM(cells, 2)
    cdef uint8_t* fog = <uint8_t*>cnp.PyArray_DATA(cells) + player * height * width if world.fog else NULL
    cdef boolean* flies = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>types.flying)
    cdef boolean* detects = c.visible + player * c.capacity
    cdef cnp.ndarray keep = new_ints(n), cloaks = new_ints(n), clears = new_ints(n)
    cdef int64_t* kept = ints(keep)
    cdef int64_t* cloak = ints(cloaks)
    cdef int64_t* clear = ints(clears)
    cdef int64_t slot, hides
    cdef bint own, seen, flying
    for passes in range(2):  # ground units before flying ones
        flying = passes == 1
        for i in range(n):
            slot = slots[i]
            if (flies[c.type[slot]] != 0) != flying:
                continue
            own = c.owner[slot] == player and player != OBSERVER
            seen = fog == NULL or c.owner[slot] == player or cell_of(c, slot, fog, width, height) == VISIBLE_CELL
            if not c.cloaked[slot] and not (c.burrowed[slot] and not own):
                hides = NOT_CLOAKED
            elif own:
                hides = ALLIED
            else:
                hides = DETECTED if detects[slot] or player == OBSERVER else CLOAKED
            if (seen or through_fog) and (show_cloaked or through_fog or hides != CLOAKED):
                kept[k] = slot
                cloak[k] = hides if seen else UNKNOWN
                clear[k] = seen and hides != CLOAKED
                k += 1
    return columns(world, types, c, player, keep[:k], cloaks[:k], clear)


cdef inline uint8_t cell_of(Columns c, int64_t slot, uint8_t* fog, int64_t width, int64_t height) noexcept:
    """Return what the player knows of the ground under a unit."""
    cdef int64_t x = <int64_t>c.pos[slot].x, y = <int64_t>c.pos[slot].y
    return fog[min(max(y, 0), height - 1) * width + min(max(x, 0), width - 1)]


cdef columns(world, types, Columns c, int64_t player, cnp.ndarray slot_column, cnp.ndarray cloaks, int64_t* clear):
    """Return a `Sight` of these slots."""
    cdef Py_ssize_t n = cnp.PyArray_DIM(slot_column, 0), i, at, type_count = len(types.id)
    cdef int64_t* slots = ints(slot_column)
    cdef int64_t slot, row, owner
    cdef bint own, foreign_fakes = False, jobs = bool(world.jobs)
    stats = world.stats
    cdef Heights heights = Heights(world.map.terrain)
    cdef int64_t* ids = ints(types.id)
    cdef double* above = floats(types.height)
    cdef double* radii = floats(types.radius)
    cdef boolean* flies = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>types.flying)
    cdef double* most_life = floats(stats.life_max)
    cdef double* most_shields = floats(stats.shields_max)
    cdef double* most_energy = floats(stats.energy_max)
    cdef cnp.ndarray rows = new_ints(n), tags = new_ints(n), type_ids = new_ints(n), owners = new_ints(n)
    cdef cnp.ndarray alliances = new_ints(n), displays = new_ints(n), pos = new_points(n), headings = new_points(n)
    cdef cnp.ndarray z = new_floats(n), radius = new_floats(n), progress = new_floats(n)
    cdef cnp.ndarray life = new_floats(n), life_max = new_floats(n), shields = new_floats(n)
    cdef cnp.ndarray shields_max = new_floats(n), energy = new_floats(n), energy_max = new_floats(n)
    cdef cnp.ndarray flying = new_flags(n), burrowed = new_flags(n), fakes = new_flags(n), active = new_flags(n)
    for i in range(n):
        slot = slots[i]
        row, owner = c.type[slot], c.owner[slot]
        at = owner * type_count + row
        own = owner == player and player != OBSERVER
        ints(rows)[i] = row
        ints(tags)[i] = c.tag[slot]
        ints(type_ids)[i] = ids[row]
        ints(owners)[i] = API_NEUTRAL if owner == 0 else owner
        ints(alliances)[i] = SELF if own else NEUTRAL if owner == 0 else ENEMY
        ints(displays)[i] = VISIBLE if clear[i] else HIDDEN
        floats(pos)[2 * i], floats(pos)[2 * i + 1] = c.pos[slot].x, c.pos[slot].y
        floats(headings)[2 * i], floats(headings)[2 * i + 1] = c.heading[slot].x, c.heading[slot].y
        floats(z)[i] = heights.at(c.pos[slot].x, c.pos[slot].y) + above[row]
        floats(radius)[i] = radii[row]
        floats(life)[i] = c.life[slot] * clear[i]
        floats(life_max)[i] = most_life[at] * clear[i]
        floats(shields)[i] = c.shields[slot] * clear[i]
        floats(shields_max)[i] = most_shields[at] * clear[i]
        floats(energy)[i] = c.energy[slot] * clear[i]
        floats(energy_max)[i] = most_energy[at] * clear[i]
        floats(progress)[i] = c.build_progress[slot]
        flags(flying)[i] = flies[row]
        flags(burrowed)[i] = c.burrowed[slot]
        flags(fakes)[i] = c.hallucination[slot]
        foreign_fakes |= c.hallucination[slot] and not own
        flags(active)[i] = clear[i] and (
            c.order_kind[slot] != IDLE or c.target[slot] >= 0 or jobs and slot in world.jobs
        )
    if foreign_fakes and player != OBSERVER:
        foreign = (fakes & (alliances != SELF)).nonzero()[0]
        fakes[foreign] = detected(world, player, slot_column[foreign])
    return rules.Sight(
        slot=slot_column, row=rows, tag=tags, type_id=type_ids, owner=owners, alliance=alliances, display=displays,
        cloak=cloaks, pos=pos, z=z, facing=geometry.facing(headings), radius=radius, life=life, life_max=life_max,
        shields=shields, shields_max=shields_max, energy=energy, energy_max=energy_max, build_progress=progress,
        flying=flying, burrowed=burrowed, hallucination=fakes, active=active,
    )  # fmt: skip


def layer_values(sight, selected, cnp.ndarray values):
    """Write the first rows of `api.layers.unit_values`, those that every unit has, into values [k, n]."""
    cdef Py_ssize_t n = cnp.PyArray_DIM(values, 1), i
    cdef int32_t* out = <int32_t*>cnp.PyArray_DATA(values)
    cdef int64_t* owner = ints(sight.owner)
    cdef int64_t* alliance = ints(sight.alliance)
    cdef int64_t* type_id = ints(sight.type_id)
    cdef int64_t* cloak = ints(sight.cloak)
    cdef int64_t* display = ints(sight.display)
    cdef boolean* chosen = flags(selected)
    cdef boolean* fake = flags(sight.hallucination)
    cdef boolean* active = flags(sight.active)
    cdef double* progress = floats(sight.build_progress)
    cdef double* life = floats(sight.life)
    cdef double* life_max = floats(sight.life_max)
    cdef double* shields = floats(sight.shields)
    cdef double* shields_max = floats(sight.shields_max)
    cdef double* energy = floats(sight.energy)
    cdef double* energy_max = floats(sight.energy_max)
    for i in range(n):
        out[i] = <int32_t>owner[i]
        out[n + i] = <int32_t>alliance[i]
        out[2 * n + i] = <int32_t>type_id[i]
        out[3 * n + i] = chosen[i]
        out[4 * n + i], out[5 * n + i] = <int32_t>life[i], ratio(life[i], life_max[i])
        out[6 * n + i], out[7 * n + i] = <int32_t>shields[i], ratio(shields[i], shields_max[i])
        out[8 * n + i], out[9 * n + i] = <int32_t>energy[i], ratio(energy[i], energy_max[i])
        out[10 * n + i] = fake[i]
        out[11 * n + i] = cloak[i] != NOT_CLOAKED and cloak[i] != UNKNOWN
        out[12 * n + i] = active[i]
        out[13 * n + i] = <int32_t>(progress[i] * 255) if progress[i] < 1 else 0
        out[14 * n + i] = display[i] == PLACEHOLDER


cdef inline int32_t ratio(double part, double whole) noexcept:
    """Return a share as 0 to 255."""
    return <int32_t>(least(part / most(whole, 1e-9), 1.0) * 255)


cdef inline cnp.ndarray new_flags(Py_ssize_t n):
    """Return a new bool array (n,), not filled."""
    cdef cnp.npy_intp size = n
    return cnp.PyArray_EMPTY(1, &size, cnp.NPY_BOOL, 0)


cdef inline boolean* flags(cnp.ndarray array):
    """Return the values of a bool array whose memory is contiguous."""
    return <boolean*>cnp.PyArray_DATA(array)
