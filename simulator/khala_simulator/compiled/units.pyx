"""The units of an observation, compiled; `api.raw` has the rules, and writes what only few units have."""
cimport numpy as cnp
from libc.stdint cimport int64_t, uint8_t, uint32_t, uint64_t
from libc.stdlib cimport free, malloc, realloc
from libc.string cimport memcpy

from khala_simulator.native.columns cimport Columns, columns_of
from khala_simulator.native.memory cimport boolean
from khala_simulator.compiled.heights cimport Heights
from khala_simulator.compiled.numbers cimport least, most

from khala_simulator.api import sight as perception
from khala_simulator.world import orders as kinds

cnp.import_array()

cdef int64_t VISIBLE = perception.Display.VISIBLE
cdef int64_t HIDDEN = perception.Display.HIDDEN
cdef int64_t SELF = perception.Alliance.SELF
cdef int64_t ENEMY = perception.Alliance.ENEMY
cdef int64_t NEUTRAL = perception.Alliance.NEUTRAL
cdef int64_t IDLE = kinds.OrderKind.IDLE
cdef int64_t ATTACK_UNIT = kinds.OrderKind.ATTACK_UNIT
cdef int64_t FOLLOW = kinds.OrderKind.FOLLOW
cdef int64_t HOLD = kinds.OrderKind.HOLD
cdef int64_t CAST = kinds.OrderKind.CAST
cdef int64_t ATTACK = kinds.ATTACK

cdef enum:
    PLAYERS = 32
    ROOM = 512  # bytes that the fields of known size take at most, in one unit


cdef struct Bytes:
    uint8_t* data
    Py_ssize_t used
    Py_ssize_t size


def encode(units):
    """Return all units of `api.raw.Units`, as the field `units` of an `ObservationRaw`."""
    world, types, sight, worn = units.world, units.types, units.sight, units.worn
    cdef Columns c = columns_of(world)
    cdef Py_ssize_t n = len(sight), i
    cdef int64_t slot, row, owner, side
    cdef int64_t* slots = <int64_t*>start(cnp.NPY_INT64, sight.slot)
    cdef int64_t* rows = <int64_t*>start(cnp.NPY_INT64, sight.row)
    cdef int64_t* display = <int64_t*>start(cnp.NPY_INT64, sight.display)
    cdef int64_t* alliance = <int64_t*>start(cnp.NPY_INT64, sight.alliance)
    cdef int64_t* tag = <int64_t*>start(cnp.NPY_INT64, sight.tag)
    cdef int64_t* type_id = <int64_t*>start(cnp.NPY_INT64, sight.type_id)
    cdef int64_t* owners = <int64_t*>start(cnp.NPY_INT64, sight.owner)
    cdef int64_t* cloak = <int64_t*>start(cnp.NPY_INT64, sight.cloak)
    cdef double* pos = <double*>start(cnp.NPY_FLOAT64, sight.pos)
    cdef double* z = <double*>start(cnp.NPY_FLOAT64, sight.z)
    cdef double* facing = <double*>start(cnp.NPY_FLOAT64, sight.facing)
    cdef double* radius = <double*>start(cnp.NPY_FLOAT64, sight.radius)
    cdef double* progress = <double*>start(cnp.NPY_FLOAT64, sight.build_progress)
    cdef double* life = <double*>start(cnp.NPY_FLOAT64, sight.life)
    cdef double* life_max = <double*>start(cnp.NPY_FLOAT64, sight.life_max)
    cdef double* shields = <double*>start(cnp.NPY_FLOAT64, sight.shields)
    cdef double* shields_max = <double*>start(cnp.NPY_FLOAT64, sight.shields_max)
    cdef double* energy = <double*>start(cnp.NPY_FLOAT64, sight.energy)
    cdef double* energy_max = <double*>start(cnp.NPY_FLOAT64, sight.energy_max)
    cdef boolean* flying = <boolean*>start(cnp.NPY_BOOL, sight.flying)
    cdef boolean* burrowed = <boolean*>start(cnp.NPY_BOOL, sight.burrowed)
    cdef boolean* hallucination = <boolean*>start(cnp.NPY_BOOL, sight.hallucination)
    cdef boolean* active = <boolean*>start(cnp.NPY_BOOL, sight.active)
    cdef boolean* selected = <boolean*>start(cnp.NPY_BOOL, units.selected)
    cdef boolean* on_screen = <boolean*>start(cnp.NPY_BOOL, units.on_screen)
    cdef boolean* structure = <boolean*>start(cnp.NPY_BOOL, types.structure)
    cdef boolean* armed = <boolean*>start(cnp.NPY_BOOL, types.armed)
    cdef boolean* needs_power = <boolean*>start(cnp.NPY_BOOL, types.needs_power)
    cdef boolean* minerals_in = <boolean*>start(cnp.NPY_BOOL, types.minerals_in)
    cdef boolean* vespene_in = <boolean*>start(cnp.NPY_BOOL, types.vespene_in)
    cdef int64_t* cargo = <int64_t*>start(cnp.NPY_INT64, types.cargo)
    cdef Py_ssize_t type_count = len(types.structure)
    cdef double x0 = units.origin[0], y0 = units.origin[1]
    cdef bint buffed = worn is not None, fixed
    cdef bint jobs = bool(world.jobs), rallies = bool(world.rallies)
    cdef Heights heights = Heights(world.map.terrain)
    cdef int64_t loop = world.loop
    cdef int64_t* levels[PLAYERS]
    levels_of = [types.levels(tuple(player.upgrades)) for player in world.players]  # keeps them alive
    if len(levels_of) > PLAYERS:
        raise ValueError(f"{len(levels_of)} players; at most {PLAYERS} are possible")
    for i in range(len(levels_of)):
        levels[i] = <int64_t*>start(cnp.NPY_INT64, levels_of[i])
    staff = units.harvesters
    cdef set lasting = set(world.buffs.rows["slot"].tolist())
    cdef dict worn_by = {}
    if buffed:
        for place, number in zip(worn.row.tolist(), worn.id.tolist(), strict=True):
            worn_by.setdefault(place, []).append(number)
    cdef Bytes out, body
    allocate(&out, 256 * n + ROOM)
    allocate(&body, 2 * ROOM)
    try:
        for i in range(n):
            slot, row, side = slots[i], rows[i], alliance[i]
            body.used = 0
            reserve(&body, ROOM)
            put_number(&body, 1, display[i])
            put_number(&body, 2, side)
            put_number(&body, 3, tag[i])
            put_number(&body, 4, type_id[i])
            put_number(&body, 5, owners[i])
            put_head(&body, 6, 15)
            put_float(&body, 1, pos[2 * i] - x0)
            put_float(&body, 2, pos[2 * i + 1] - y0)
            put_float(&body, 3, z[i])
            put_float(&body, 7, facing[i])
            put_float(&body, 8, radius[i])
            put_float(&body, 9, progress[i])
            put_number(&body, 10, cloak[i])
            if display[i] != VISIBLE and display[i] != HIDDEN:
                put_number(&body, 12, on_screen[i])
                put_number(&body, 13, 0)
                put_message(&out, 2, &body)
                continue
            put_number(&body, 11, selected[i])
            put_number(&body, 12, on_screen[i])
            put_number(&body, 13, 0)
            put_float(&body, 14, life[i])
            put_float(&body, 15, life_max[i])
            put_float(&body, 16, shields[i])
            put_float(&body, 17, energy[i])
            if minerals_in[row] and c.contents[slot]:
                put_number(&body, 18, c.contents[slot])
            if vespene_in[row] and c.contents[slot]:
                put_number(&body, 19, c.contents[slot])
            put_number(&body, 20, flying[i])
            put_number(&body, 21, burrowed[i])
            if side == SELF:
                if c.order_kind[slot] == IDLE and jobs and slot in world.jobs or world.queue[slot]:
                    put_bytes(&body, units.orders(slot))
                else:
                    put_order(&body, c, slot, heights, x0, y0, loop)
                if c.addon[slot] >= 0:
                    put_number(&body, 23, c.tag[c.addon[slot]])
                if cargo[row]:
                    if carries(c, slot, world.top):
                        put_bytes(&body, units.cargo(slot))
                    else:
                        put_number(&body, 25, 0)
                        put_number(&body, 26, cargo[row])
            if buffed and i in worn_by:
                reserve(&body, ROOM + 8 * len(worn_by[i]))
                for number in worn_by[i]:
                    put_number(&body, 27, number)
            fixed = structure[row] or side == NEUTRAL
            if side == SELF:
                workers, ideal = staff.get(slot, (0, 0))
                put_number(&body, 28, workers)
                put_number(&body, 29, ideal)
                if armed[row]:
                    put_float(&body, 30, most(0.0, c.cooldown[slot]))
                if c.detects[slot]:
                    put_float(&body, 31, c.detects[slot])
                if armed[row] and c.target[slot] >= 0 and c.tag[c.target[slot]]:
                    put_number(&body, 34, c.tag[c.target[slot]])
            if fixed:
                put_number(&body, 35, needs_power[row] and c.powered[slot] and c.build_progress[slot] >= 1.0)
            put_float(&body, 36, shields_max[i])
            put_float(&body, 37, energy_max[i])
            put_number(&body, 38, hallucination[i])
            put_number(&body, 39, active[i])
            owner = c.owner[slot]
            if not fixed or armed[row]:
                put_number(&body, 40, levels[owner][row])
            put_number(&body, 41, levels[owner][type_count + row])
            put_number(&body, 42, levels[owner][2 * type_count + row])
            if side == SELF:
                if c.expires[slot]:
                    put_number(&body, 43, max(0, c.expires[slot] - loop))
                    put_number(&body, 44, c.expires[slot] - c.born_loop[slot])
                elif lasting and slot in lasting:
                    put_bytes(&body, units.durations(slot))
                if rallies and slot in world.rallies:
                    put_bytes(&body, units.rallies(slot))
            put_message(&out, 2, &body)
        return <bytes>(<char*>out.data)[: out.used]
    finally:
        free(out.data)
        free(body.data)


def encode_panel(world, types, list slots, int64_t player):
    """Return what the panel says of units, as the field `units` of a `MultiPanel`; `api.ui` has the rule."""
    cdef Columns c = columns_of(world)
    cdef int64_t* type_id = <int64_t*>start(cnp.NPY_INT64, types.id)
    cdef Py_ssize_t type_count = len(types.id)
    cdef double* life_max = <double*>start(cnp.NPY_FLOAT64, world.stats.life_max)  # (players, types)
    cdef double* shields_max = <double*>start(cnp.NPY_FLOAT64, world.stats.shields_max)
    cdef double* energy_max = <double*>start(cnp.NPY_FLOAT64, world.stats.energy_max)
    cdef int64_t slot, owner, side
    cdef Py_ssize_t at
    cdef uint8_t data[128]
    cdef Bytes out, unit
    unit.data, unit.size = data, 128
    allocate(&out, 64 * len(slots) + ROOM)
    try:
        for slot in slots:
            unit.used = 0
            owner = c.owner[slot]
            at = owner * type_count + c.type[slot]
            side = SELF if owner == player else NEUTRAL if owner == 0 else ENEMY
            put_number(&unit, 1, type_id[c.type[slot]])
            put_number(&unit, 2, side)
            put_number(&unit, 3, <int64_t>c.life[slot])
            put_number(&unit, 4, <int64_t>c.shields[slot])
            put_number(&unit, 5, <int64_t>c.energy[slot])
            put_number(&unit, 6, 0)
            put_float(&unit, 7, c.build_progress[slot])
            put_number(&unit, 9, <int64_t>life_max[at])
            put_number(&unit, 10, <int64_t>shields_max[at])
            put_number(&unit, 11, <int64_t>energy_max[at])
            put_message(&out, 1, &unit)
        return <bytes>(<char*>out.data)[: out.used]
    finally:
        free(out.data)


cdef put_order(Bytes* body, Columns c, int64_t slot, Heights heights, double x0, double y0, int64_t loop):
    """Write the only order of a unit, as `World.orders_of` has it, or nothing for an idle one."""
    cdef int64_t kind = c.order_kind[slot], tag = 0, ability = c.order_ability[slot]
    cdef bint targeted, pointed
    cdef double x, y, done = 0.0
    cdef uint8_t data[64]
    cdef Bytes order
    order.data, order.used, order.size = data, 0, 64
    if kind == IDLE:
        if c.target[slot] < 0:
            return
        ability, tag, pointed = ATTACK, c.tag[c.target[slot]], False
    else:
        targeted = kind == ATTACK_UNIT or kind == FOLLOW or c.order_target[slot] >= 0
        pointed = not (targeted or kind == HOLD or not c.order_aimed[slot])
        if targeted and c.order_target[slot] >= 0:
            tag = c.tag[c.order_target[slot]]
        if kind == CAST and c.cast_at[slot] > c.cast_begun[slot] >= 0.0:
            done = (loop - c.cast_begun[slot]) / (c.cast_at[slot] - c.cast_begun[slot])
            done = least(most(done, 0.0), 1.0)
    put_number(&order, 1, ability)
    if tag:
        put_number(&order, 3, tag)
    elif pointed:
        x, y = c.order_point[slot].x, c.order_point[slot].y
        put_head(&order, 2, 15)
        put_float(&order, 1, x - x0)
        put_float(&order, 2, y - y0)
        put_float(&order, 3, heights.at(x, y))
    if done:
        put_float(&order, 4, done)
    put_message(body, 22, &order)


cdef bint carries(Columns c, int64_t slot, Py_ssize_t n) noexcept:
    """Return whether a unit has passengers."""
    cdef Py_ssize_t other
    for other in range(n):
        if c.carrier[other] == slot and c.alive[other]:
            return True
    return False


cdef void* start(int kind, object column) except NULL:
    """Return where an array of numpy's type `kind` begins; its values must lie one after the other."""
    cdef cnp.ndarray array = column
    if not cnp.PyArray_ISCARRAY_RO(array) or cnp.PyArray_TYPE(array) != kind:
        raise ValueError(f"a column of an observation has the dtype {array.dtype}, or is not contiguous")
    return cnp.PyArray_DATA(array)


# protobuf -------------------------------------------------------------------------------------------------------------


cdef int allocate(Bytes* to, Py_ssize_t size) except -1:
    """Allocate room for so many bytes."""
    to.data, to.used, to.size = <uint8_t*>malloc(size), 0, size
    if to.data == NULL:
        raise MemoryError
    return 0


cdef int reserve(Bytes* to, Py_ssize_t more) except -1:
    """Make room for so many bytes more."""
    if to.used + more > to.size:
        size = 2 * (to.used + more)
        data = <uint8_t*>realloc(to.data, size)
        if data == NULL:
            raise MemoryError
        to.data, to.size = data, size
    return 0


cdef inline void put_varint(Bytes* to, uint64_t number) noexcept:
    """Write a number, 7 bits a byte, lowest first."""
    while number > 0x7F:
        to.data[to.used] = <uint8_t>(number & 0x7F | 0x80)
        to.used += 1
        number >>= 7
    to.data[to.used] = <uint8_t>number
    to.used += 1


cdef inline void put_number(Bytes* to, uint32_t field, int64_t number) noexcept:
    """Write a field that holds an integer, a bool or an enum."""
    put_varint(to, field << 3)
    put_varint(to, <uint64_t>number)


cdef inline void put_float(Bytes* to, uint32_t field, double number) noexcept:
    """Write a field that holds a float."""
    cdef float single = <float>number
    put_varint(to, field << 3 | 5)
    memcpy(to.data + to.used, &single, 4)
    to.used += 4


cdef inline void put_head(Bytes* to, uint32_t field, Py_ssize_t size) noexcept:
    """Write what stands before the bytes of a field that holds a message."""
    put_varint(to, field << 3 | 2)
    put_varint(to, size)


cdef int put_message(Bytes* to, uint32_t field, Bytes* message) except -1:
    """Write a field that holds a message."""
    reserve(to, message.used + 16)
    put_head(to, field, message.used)
    memcpy(to.data + to.used, message.data, message.used)
    to.used += message.used
    return 0


cdef int put_bytes(Bytes* to, bytes fields) except -1:
    """Write fields that are already serialized."""
    reserve(to, len(fields) + ROOM)
    memcpy(to.data + to.used, <char*>fields, len(fields))
    to.used += len(fields)
    return 0
