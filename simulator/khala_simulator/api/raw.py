"""The units of `Observation.raw_data`, with every field that the game would send of them.

Which field is present depends on the unit's owner and on how it is perceived; that table comes from 96 real
observations. Above: `observation.py`. Below: `sight.py`, and `wire.py`, which writes messages.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING, Final

from khala_simulator.api import fields, wire
from khala_simulator.api.sight import Alliance, Display
from khala_simulator.economy import harvesting
from khala_simulator.native import columns, memory
from khala_simulator.world.active_buffs import FOREVER
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import ATTACK, OrderKind

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from khala_simulator.api.effects import Worn
    from khala_simulator.api.sight import Sight
    from khala_simulator.api.types import Types
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

    Bools = NDArray[np.bool_]

SELF: Final = Alliance.SELF.value
NEUTRAL: Final = Alliance.NEUTRAL.value
VISIBLE: Final = Display.VISIBLE.value
HIDDEN: Final = Display.HIDDEN.value
IDLE: Final = OrderKind.IDLE.value
ATTACK_UNIT: Final = OrderKind.ATTACK_UNIT.value
FOLLOW: Final = OrderKind.FOLLOW.value
HOLD: Final = OrderKind.HOLD.value
CAST: Final = OrderKind.CAST.value


@dataclasses.dataclass(frozen=True)
class PerceivedUnits:
    """The input for the units' fields: their perception, and their state in the player's interface."""

    world: World
    types: Types
    sight: Sight
    selected: Bools
    on_screen: Bools
    origin: tuple[float, float]  # world point that is (0, 0) for the client
    worn: Worn | None = None  # buffs on them
    player: int = 0  # whose observation it is

    @functools.cached_property
    def harvesters(self) -> dict[int, tuple[int, int]]:
        """The number of workers of own town halls and gas structures (slots), and the ideal number."""
        return harvesting.staffing(self.world, self.player)

    def encode(self) -> bytes:
        """Return all units, as the field `units` of an `ObservationRaw`."""
        return _encode(self)


class _View:
    """What the fields are made from, as rows of numbers, and a message for parts of units."""

    def __init__(self, units: PerceivedUnits) -> None:
        world, types, sight = units.world, units.types, units.sight
        self.units = units  # keeps the memory alive
        self.world = world
        self.c = columns.columns_of(world)
        self.heights = world.map.terrain.heights
        self.part = wire.MessageWriter(256)
        self.loop = world.loop
        self.top = world.top
        self.x0, self.y0 = units.origin
        self.makes = bool(world.jobs)
        self.rallies = bool(world.rallies)
        self.harvesters = units.harvesters
        self.buffs = _buffs_by_row(units.worn)
        self.lasting = _last_ends(world)
        self.slot = memory.ints(sight.slot)
        self.row = memory.ints(sight.row)
        self.tag = memory.ints(sight.tag)
        self.type_id = memory.ints(sight.type_id)
        self.owner = memory.ints(sight.owner)
        self.alliance = memory.ints(sight.alliance)
        self.display = memory.ints(sight.display)
        self.cloak = memory.ints(sight.cloak)
        self.pos = memory.points(sight.pos)
        self.z = memory.floats(sight.z)
        self.facing = memory.floats(sight.facing)
        self.radius = memory.floats(sight.radius)
        self.life = memory.floats(sight.life)
        self.life_max = memory.floats(sight.life_max)
        self.shields = memory.floats(sight.shields)
        self.shields_max = memory.floats(sight.shields_max)
        self.energy = memory.floats(sight.energy)
        self.energy_max = memory.floats(sight.energy_max)
        self.build_progress = memory.floats(sight.build_progress)
        self.flying = memory.bools(sight.flying)
        self.burrowed = memory.bools(sight.burrowed)
        self.hallucination = memory.bools(sight.hallucination)
        self.active = memory.bools(sight.active)
        self.selected = memory.bools(units.selected)
        self.on_screen = memory.bools(units.on_screen)
        self.type_count = len(types.id)
        self.type_ids = memory.ints(types.id)
        self.structure = memory.bools(types.structure)
        self.armed = memory.bools(types.armed)
        self.needs_power = memory.bools(types.needs_power)
        self.minerals_in = memory.bools(types.minerals_in)
        self.vespene_in = memory.bools(types.vespene_in)
        self.cargo = memory.ints(types.cargo)
        self.level_table = types.levels_of(tuple(tuple(player.upgrades) for player in world.players))
        self.levels = memory.ints(self.level_table)  # attack, armor and shield of every player and type


def _buffs_by_row(worn: Worn | None) -> dict[int, list[int]]:
    """Return the buffs of the API on each row of the sight that has any."""
    found: dict[int, list[int]] = {}
    if worn is not None:
        for row, buff in zip(worn.row.tolist(), worn.id.tolist(), strict=True):
            found.setdefault(row, []).append(buff)
    return found


def _last_ends(world: World) -> dict[int, tuple[int, float]]:
    """Return when the buff that ends last on a unit has begun and ends, by slot; buffs without an end do not count."""
    found: dict[int, tuple[int, float]] = {}
    if len(world.buffs):
        rows = world.buffs.rows
        for slot, begun, end in zip(rows["slot"].tolist(), rows["begun"].tolist(), rows["end"].tolist(), strict=True):
            if end < FOREVER and (slot not in found or end > found[slot][1]):
                found[slot] = begun, end
    return found


def _encode(units: PerceivedUnits) -> bytes:
    """Return the units as a field of an observation; those that are only remembered or planned have few fields."""
    view = _View(units)
    n = len(units.sight)
    message = wire.MessageWriter(256 * n + 512)
    unit = wire.MessageWriter(1024)
    for i in range(n):
        unit.clear()
        is_here = view.display[i] == VISIBLE or view.display[i] == HIDDEN
        own = view.alliance[i] == SELF
        _put_known(unit, view, i, is_here)
        if is_here:
            _put_vitals(unit, view, i)
            if own:
                _put_orders(unit, view, view.slot[i])
                _put_load(unit, view, view.slot[i], view.row[i])
            if view.buffs and i in view.buffs:
                for buff in view.buffs[i]:
                    unit.put_number(fields.BUFF_IDS, buff)
            if own:
                _put_service(unit, view, view.slot[i], view.row[i])
            _put_standing(unit, view, i)
            if own:
                _put_time_left(unit, view, view.slot[i])
                if view.rallies:
                    _put_rallies(unit, view, view.slot[i])
        message.put_message(fields.UNITS, unit)
    return message.content()


def _put_known(unit: wire.MessageWriter, view: _View, i: int, is_here: bool) -> None:
    """Write the fields that remembered and planned units have as well."""
    unit.put_number(fields.DISPLAY_TYPE, view.display[i])
    unit.put_number(fields.ALLIANCE, view.alliance[i])
    unit.put_number(fields.TAG, view.tag[i])
    unit.put_number(fields.UNIT_TYPE, view.type_id[i])
    unit.put_number(fields.OWNER, view.owner[i])
    unit.put_point(fields.POS, view.pos[i].x - view.x0, view.pos[i].y - view.y0, view.z[i])
    unit.put_float(fields.FACING, view.facing[i])
    unit.put_float(fields.RADIUS, view.radius[i])
    unit.put_float(fields.BUILD_PROGRESS, view.build_progress[i])
    unit.put_number(fields.CLOAK, view.cloak[i])
    if is_here:
        unit.put_number(fields.IS_SELECTED, view.selected[i])
    unit.put_number(fields.IS_ON_SCREEN, view.on_screen[i])
    unit.put_number(fields.IS_BLIP, False)


def _put_vitals(unit: wire.MessageWriter, view: _View, i: int) -> None:
    """Write life, shields and energy, what a resource still holds, and where the unit is."""
    row = view.row[i]
    contents = view.c.contents[view.slot[i]]
    unit.put_float(fields.HEALTH, view.life[i])
    unit.put_float(fields.HEALTH_MAX, view.life_max[i])
    unit.put_float(fields.SHIELD, view.shields[i])
    unit.put_float(fields.ENERGY, view.energy[i])
    if contents and view.minerals_in[row]:
        unit.put_number(fields.MINERAL_CONTENTS, contents)
    if contents and view.vespene_in[row]:
        unit.put_number(fields.VESPENE_CONTENTS, contents)
    unit.put_number(fields.IS_FLYING, view.flying[i])
    unit.put_number(fields.IS_BURROWED, view.burrowed[i])


def _put_standing(unit: wire.MessageWriter, view: _View, i: int) -> None:
    """Write what its owner's upgrades and its state make of the unit; what can't move may have power."""
    c = view.c
    slot = view.slot[i]
    row = view.row[i]
    fixed = view.structure[row] or view.alliance[i] == NEUTRAL
    levels = 3 * c.owner[slot] * view.type_count + row
    if fixed:
        powered = view.needs_power[row] and c.powered[slot] and c.build_progress[slot] >= 1.0
        unit.put_number(fields.IS_POWERED, powered)
    unit.put_float(fields.SHIELD_MAX, view.shields_max[i])
    unit.put_float(fields.ENERGY_MAX, view.energy_max[i])
    unit.put_number(fields.IS_HALLUCINATION, view.hallucination[i])
    unit.put_number(fields.IS_ACTIVE, view.active[i])
    if not fixed or view.armed[row]:
        unit.put_number(fields.ATTACK_UPGRADE_LEVEL, view.levels[levels])
    unit.put_number(fields.ARMOR_UPGRADE_LEVEL, view.levels[levels + view.type_count])
    unit.put_number(fields.SHIELD_UPGRADE_LEVEL, view.levels[levels + 2 * view.type_count])


# own units ------------------------------------------------------------------------------------------------------------


def _put_orders(unit: wire.MessageWriter, view: _View, slot: int) -> None:
    """Write its orders, as `World.orders_of` has them."""
    world = view.world
    if world.queue[slot] or (view.makes and view.c.order_kind[slot] == IDLE and slot in world.jobs):
        for order in world.orders_of(slot):
            x, y = order.point or (0.0, 0.0)
            _put_order(unit, view, order.ability, order.target, order.point is not None, x, y, order.progress)
    else:
        _put_only_order(unit, view, slot)


def _put_only_order(unit: wire.MessageWriter, view: _View, slot: int) -> None:
    """Write the only order of a unit; an idle one may fight by itself."""
    c = view.c
    kind = c.order_kind[slot]
    if kind != IDLE:
        target = c.order_target[slot]
        aimed = c.order_aimed[slot] and target == NOBODY and kind not in (ATTACK_UNIT, FOLLOW, HOLD)
        tag = c.tag[target] if target != NOBODY else 0
        progress = _progress(c, slot, view.loop) if kind == CAST else 0.0
        x = c.order_point[slot].x
        y = c.order_point[slot].y
        _put_order(unit, view, c.order_ability[slot], tag, aimed, x, y, progress)
    elif c.target[slot] != NOBODY:
        _put_order(unit, view, ATTACK, c.tag[c.target[slot]], False, 0.0, 0.0, 0.0)


def _progress(c: Columns, slot: int, loop: int) -> float:
    """Return the elapsed part of an ability's preparation, 0..1."""
    begun = c.cast_begun[slot]
    end = c.cast_at[slot]
    progress: float = min(max((loop - begun) / (end - begun), 0.0), 1.0) if end > begun >= 0.0 else 0.0
    return progress


def _put_order(
    unit: wire.MessageWriter, view: _View, ability: int, target: int, aimed: bool, x: float, y: float, progress: float
) -> None:
    """Write one order: its target is a unit, or else a point if it is aimed at one."""
    order = view.part
    order.clear()
    order.put_number(fields.ORDER_ABILITY_ID, ability)
    if target:
        order.put_number(fields.ORDER_TARGET_UNIT_TAG, target)
    elif aimed:
        order.put_point(fields.ORDER_TARGET_WORLD_SPACE_POS, x - view.x0, y - view.y0, view.heights.at(x, y))
    if progress:
        order.put_float(fields.ORDER_PROGRESS, progress)
    unit.put_message(fields.ORDERS, order)


def _put_load(unit: wire.MessageWriter, view: _View, slot: int, row: int) -> None:
    """Write its add-on, its passengers, and the room that they take."""
    c = view.c
    if c.addon[slot] != NOBODY:
        unit.put_number(fields.ADD_ON_TAG, c.tag[c.addon[slot]])
    if view.cargo[row]:
        taken = 0
        for inside in range(view.top):
            if c.carrier[inside] == slot and c.alive[inside]:
                _put_passenger(unit, view, inside)
                taken += view.world.unit_type(inside).cargo_size
        unit.put_number(fields.CARGO_SPACE_TAKEN, taken)
        unit.put_number(fields.CARGO_SPACE_MAX, view.cargo[row])


def _put_passenger(unit: wire.MessageWriter, view: _View, slot: int) -> None:
    """Write a unit inside of another."""
    c = view.c
    passenger = view.part
    passenger.clear()
    passenger.put_number(fields.PASSENGER_TAG, c.tag[slot])
    passenger.put_float(fields.PASSENGER_HEALTH, c.life[slot])
    passenger.put_float(fields.PASSENGER_HEALTH_MAX, c.life_max[slot])
    passenger.put_float(fields.PASSENGER_SHIELD, c.shields[slot])
    passenger.put_float(fields.PASSENGER_ENERGY, c.energy[slot])
    passenger.put_number(fields.PASSENGER_UNIT_TYPE, view.type_ids[c.type[slot]])
    passenger.put_float(fields.PASSENGER_SHIELD_MAX, c.shields_max[slot])
    passenger.put_float(fields.PASSENGER_ENERGY_MAX, c.energy_max[slot])
    unit.put_message(fields.PASSENGERS, passenger)


def _put_service(unit: wire.MessageWriter, view: _View, slot: int, row: int) -> None:
    """Write its workers, its weapon and its sensors."""
    c = view.c
    workers = 0
    ideal = 0
    if slot in view.harvesters:
        workers, ideal = view.harvesters[slot]
    unit.put_number(fields.ASSIGNED_HARVESTERS, workers)
    unit.put_number(fields.IDEAL_HARVESTERS, ideal)
    if view.armed[row]:
        unit.put_float(fields.WEAPON_COOLDOWN, max(0.0, c.cooldown[slot]))
    if c.detects[slot]:
        unit.put_float(fields.DETECT_RANGE, c.detects[slot])
    if view.armed[row] and c.target[slot] != NOBODY and c.tag[c.target[slot]]:
        unit.put_number(fields.ENGAGED_TARGET_TAG, c.tag[c.target[slot]])


def _put_time_left(unit: wire.MessageWriter, view: _View, slot: int) -> None:
    """Write how long its timed life, or else the buff that ends last, still lasts."""
    c = view.c
    if c.expires[slot]:
        unit.put_number(fields.BUFF_DURATION_REMAIN, max(0, c.expires[slot] - view.loop))
        unit.put_number(fields.BUFF_DURATION_MAX, c.expires[slot] - c.born_loop[slot])
    elif view.lasting and slot in view.lasting:
        begun, end = view.lasting[slot]
        unit.put_number(fields.BUFF_DURATION_REMAIN, max(0, round(end - view.world.loop)))
        unit.put_number(fields.BUFF_DURATION_MAX, round(end) - begun)


def _put_rallies(unit: wire.MessageWriter, view: _View, slot: int) -> None:
    """Write where a structure sends new units."""
    target = view.part
    for rally in dict.fromkeys(view.world.rallies.get(slot, {}).values()):
        x, y = rally.point
        target.clear()
        target.put_point(fields.RALLY_POINT, x - view.x0, y - view.y0, view.heights.at(x, y))
        if rally.target:
            target.put_number(fields.RALLY_TAG, rally.target)
        unit.put_message(fields.RALLY_TARGETS, target)
