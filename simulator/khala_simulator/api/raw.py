"""The units of `Observation.raw_data`, with every field that the game would send of them.

Which field is present depends on the unit's owner and on how it is perceived; that table comes from 96 real
observations. Above: `observation.py`. Below: `sight.py`.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING, Any

import numpy as np
from s2clientprotocol import raw_pb2

from khala_simulator import compiled
from khala_simulator.api.sight import Alliance
from khala_simulator.economy import harvesting
from khala_simulator.world.active_buffs import FOREVER
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from khala_simulator.api.effects import Worn
    from khala_simulator.api.sight import Sight
    from khala_simulator.api.types import Types
    from khala_simulator.world.orders import Order
    from khala_simulator.world.world import World

    Bools = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True)
class Units:
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
        kernel = compiled.part("units")
        if kernel is not None:
            encoded: bytes = kernel.encode(self)
            return encoded
        raw = raw_pb2.ObservationRaw()
        self.write(raw)
        return raw.SerializeToString()

    def write(self, raw: raw_pb2.ObservationRaw) -> None:
        """Add all units to an observation; `compiled.units` does the same without an object for each."""
        own: list[int] = self.sight.slot[self.sight.alliance == Alliance.SELF.value].tolist()
        orders = self._orders(own)
        first = len(raw.units)
        for known, vital, side, slot in zip(self._known(), self._vitals(), self._sides(), self._slots(), strict=True):
            unit = raw.units.add()
            _write_known(unit, *known)
            if unit.display_type in {raw_pb2.Snapshot, raw_pb2.Placeholder}:
                continue
            _write_vitals(unit, *vital)
            _write_side(unit, *side)
            if slot in orders:
                self._write_own(unit, slot)
                for order, height in orders[slot]:
                    self._write_order(unit.orders.add(), order, height)
        if self.worn is not None:
            for row, number in zip(self.worn.row.tolist(), self.worn.id.tolist(), strict=True):
                raw.units[first + row].buff_ids.append(number)

    # what few units have, as bytes of fields of a `Unit`, for `compiled.units`

    def orders(self, slot: int) -> bytes:
        """Return the orders of an own unit."""
        unit = raw_pb2.Unit()
        for order, height in self._orders([slot])[slot]:
            self._write_order(unit.orders.add(), order, height)
        return unit.SerializeToString()

    def cargo(self, slot: int) -> bytes:
        """Return the passengers of an own unit, and the room that they take."""
        unit = raw_pb2.Unit()
        self._write_cargo(unit, slot)
        return unit.SerializeToString()

    def durations(self, slot: int) -> bytes:
        """Return how long the life or a buff of an own unit still lasts."""
        unit = raw_pb2.Unit()
        self._write_durations(unit, slot)
        return unit.SerializeToString()

    def rallies(self, slot: int) -> bytes:
        """Return where an own structure sends new units."""
        unit = raw_pb2.Unit()
        self._write_rallies(unit, slot)
        return unit.SerializeToString()

    # columns

    def _slots(self) -> list[int]:
        slots: list[int] = self.sight.slot.tolist()
        return slots

    def _known(self) -> Iterator[tuple[Any, ...]]:
        s = self.sight
        x, y = (s.pos - self.origin).T
        return _rows(s.display, s.alliance, s.tag, s.type_id, s.owner, x, y, s.z, s.facing, s.radius,
                     s.build_progress, s.cloak, self.on_screen)  # fmt: skip

    def _vitals(self) -> Iterator[tuple[Any, ...]]:
        s = self.sight
        return _rows(s.life, s.life_max, s.shields, s.shields_max, s.energy, s.energy_max, s.flying, s.burrowed,
                     s.hallucination, s.active, self.selected)  # fmt: skip

    def _sides(self) -> Iterator[tuple[Any, ...]]:
        s, types, row = self.sight, self.types, self.sight.row
        tables = np.stack([types.levels(tuple(player.upgrades)) for player in self.world.players])
        attack, armor, shield = tables[self.world.owner[s.slot], :, row].T
        fixed = types.structure[row] | (s.alliance == Alliance.NEUTRAL.value)
        contents = self.world.contents[s.slot]
        minerals, vespene = contents * types.minerals_in[row], contents * types.vespene_in[row]
        powered = types.needs_power[row] & self.world.powered[s.slot] & (self.world.build_progress[s.slot] >= 1.0)
        return _rows(attack, armor, shield, ~fixed | types.armed[row], fixed, powered, minerals, vespene)

    def _write_own(self, unit: raw_pb2.Unit, slot: int) -> None:
        world, types, row = self.world, self.types, int(self.world.type[slot])
        unit.assigned_harvesters, unit.ideal_harvesters = self.harvesters.get(slot, (0, 0))
        self._write_rallies(unit, slot)
        if types.armed[row]:
            unit.weapon_cooldown = max(0.0, float(world.cooldown[slot]))
            if target := world.tag_of(int(world.target[slot])):
                unit.engaged_target_tag = target
        if world.detects[slot]:
            unit.detect_range = float(world.detects[slot])
        if world.addon[slot] != NOBODY:
            unit.add_on_tag = world.tag_of(int(world.addon[slot]))
        if types.cargo[row]:
            self._write_cargo(unit, slot)
        self._write_durations(unit, slot)

    def _write_rallies(self, unit: raw_pb2.Unit, slot: int) -> None:
        for rally in dict.fromkeys(self.world.rallies.get(slot, {}).values()):
            message = unit.rally_targets.add()
            x, y = rally.point
            z = float(self.world.map.terrain.ground_z(np.array([rally.point]))[0])
            message.point.x, message.point.y, message.point.z = x - self.origin[0], y - self.origin[1], z
            if rally.target:
                message.tag = rally.target

    def _write_cargo(self, unit: raw_pb2.Unit, slot: int) -> None:
        """Write the passengers and the room that they take."""
        world, inside = self.world, self.world.passengers(slot)
        unit.cargo_space_max = int(self.types.cargo[world.type[slot]])
        unit.cargo_space_taken = sum(world.unit_type(s).cargo_size for s in inside)
        for s in inside:
            unit.passengers.add(
                tag=world.tag_of(s),
                unit_type=world.unit_type(s).id,
                health=float(world.life[s]),
                health_max=float(world.life_max[s]),
                shield=float(world.shields[s]),
                shield_max=float(world.shields_max[s]),
                energy=float(world.energy[s]),
                energy_max=float(world.energy_max[s]),
            )

    def _write_durations(self, unit: raw_pb2.Unit, slot: int) -> None:
        """Write how long its timed life, or else the buff that ends last, still lasts."""
        world = self.world
        if world.expires[slot]:
            unit.buff_duration_remain = max(0, int(world.expires[slot]) - world.loop)
            unit.buff_duration_max = int(world.expires[slot] - world.born_loop[slot])
        elif len(world.buffs):
            rows = world.buffs.of(slot)
            rows = rows[rows["end"] < FOREVER]
            if len(rows):
                last = rows[rows["end"].argmax()]
                unit.buff_duration_remain = max(0, round(float(last["end"]) - world.loop))
                unit.buff_duration_max = round(float(last["end"]) - int(last["begun"]))

    def _write_order(self, message: raw_pb2.UnitOrder, order: Order, height: float) -> None:
        message.ability_id = order.ability
        if order.progress:
            message.progress = order.progress
        if order.target:
            message.target_unit_tag = order.target
        elif order.point is not None:
            point = message.target_world_space_pos
            point.x, point.y = order.point[0] - self.origin[0], order.point[1] - self.origin[1]
            point.z = height

    def _orders(self, own: list[int]) -> dict[int, list[tuple[Order, float]]]:
        """Return the orders of own units by slot, each with the ground height at its point, if it has one."""
        orders = {slot: self.world.orders_of(slot) for slot in own}
        points = [order.point for some in orders.values() for order in some if order.point is not None]
        heights = iter(self.world.map.terrain.ground_z(np.array(points)).tolist() if points else ())
        return {
            slot: [(order, 0.0 if order.point is None else next(heights)) for order in some]
            for slot, some in orders.items()
        }


def _rows(*columns: NDArray[Any]) -> Iterator[tuple[Any, ...]]:
    return zip(*(column.tolist() for column in columns), strict=True)


def _write_known(  # a row of the table, in the order of its columns
    unit: raw_pb2.Unit, display: raw_pb2.DisplayType.ValueType, alliance: raw_pb2.Alliance.ValueType, tag: int,
    type_id: int, owner: int, x: float, y: float, z: float, facing: float, radius: float, build_progress: float,
    cloak: raw_pb2.CloakState.ValueType, on_screen: bool,
) -> None:  # fmt: skip
    unit.display_type = display
    unit.alliance = alliance
    unit.tag = tag
    unit.unit_type = type_id
    unit.owner = owner
    pos = unit.pos
    pos.x, pos.y, pos.z = x, y, z
    unit.facing = facing
    unit.radius = radius
    unit.build_progress = build_progress
    unit.cloak = cloak
    unit.is_on_screen = on_screen
    unit.is_blip = False


def _write_vitals(  # a row of the table, in the order of its columns
    unit: raw_pb2.Unit, life: float, life_max: float, shields: float, shields_max: float, energy: float,
    energy_max: float, flying: bool, burrowed: bool, hallucination: bool, active: bool, selected: bool,
) -> None:  # fmt: skip
    unit.health = life
    unit.health_max = life_max
    unit.shield = shields
    unit.shield_max = shields_max
    unit.energy = energy
    unit.energy_max = energy_max
    unit.is_flying = flying
    unit.is_burrowed = burrowed
    unit.is_hallucination = hallucination
    unit.is_active = active
    unit.is_selected = selected


def _write_side(  # a row of the table, in the order of its columns
    unit: raw_pb2.Unit, attack: int, armor: int, shield: int, fights: bool, fixed: bool, powered: bool, minerals: int,
    vespene: int,
) -> None:  # fmt: skip
    unit.armor_upgrade_level, unit.shield_upgrade_level = armor, shield
    if fights:
        unit.attack_upgrade_level = attack
    if fixed:
        unit.is_powered = powered
    if minerals:
        unit.mineral_contents = minerals
    if vespene:
        unit.vespene_contents = vespene
