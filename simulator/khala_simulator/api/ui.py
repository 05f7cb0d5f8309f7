"""`Observation.ui_data`: the panel of the selection, and the control groups.

Several selected units have the multi panel; one has the production panel when it makes something, the cargo panel when
it has passengers, and else the single panel.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from s2clientprotocol import ui_pb2

from khala_simulator.api import fields, wire
from khala_simulator.api.sight import Alliance
from khala_simulator.native import columns, memory

if TYPE_CHECKING:
    from khala_simulator.api.selection import PlayerSelection
    from khala_simulator.api.types import Types
    from khala_simulator.world.world import World

SELF: Final = Alliance.SELF.value
NEUTRAL: Final = Alliance.NEUTRAL.value
ENEMY: Final = Alliance.ENEMY.value


def panel(world: World, types: Types, selection: PlayerSelection, player: int) -> ui_pb2.ObservationUI:
    """Return what a player's interface shows of the selection."""
    ui = ui_pb2.ObservationUI()
    slots = selection.slots(world)
    if len(slots) == 1:
        _write_only_unit(ui, world, types, slots[0], player)
    elif slots:
        ui.multi.MergeFromString(_encode_multi(world, types, slots, player))
    for index, tags in enumerate(selection.groups):
        if tags:
            leader = int(world.type[world.slot_of(tags[0])])
            ui.groups.add(control_group_index=index, leader_unit_type=int(types.id[leader]), count=len(tags))
    return ui


def _encode_multi(world: World, types: Types, slots: list[int], player: int) -> bytes:
    """Return a `MultiPanel`."""
    infos = _Infos(world, types, player)
    message = wire.MessageWriter(64 * len(slots) + 64)
    for slot in slots:
        infos.write(slot)
        message.put_message(fields.PANEL_UNITS, infos.info)
    return message.content()


def _write_only_unit(ui: ui_pb2.ObservationUI, world: World, types: Types, slot: int, player: int) -> None:
    own = world.owner[slot] == player
    inside = world.passengers(slot) if own and types.cargo[world.type[slot]] else []
    if own and slot in world.jobs:
        _write_production(ui.production, world, types, slot, player)
    elif inside:
        ui.cargo.unit.CopyFrom(_unit(world, types, slot, player))
        ui.cargo.passengers.extend(_unit(world, types, other, player) for other in inside)
        taken = sum(world.unit_type(other).cargo_size for other in inside)
        ui.cargo.slots_available = int(types.cargo[world.type[slot]]) - taken
    else:
        _write_single(ui.single, world, types, slot, player)


def _write_production(panel: ui_pb2.ProductionPanel, world: World, types: Types, slot: int, player: int) -> None:
    """Write the queue: units that are trained as units, and everything by its ability."""
    panel.unit.CopyFrom(_unit(world, types, slot, player))
    for job in world.jobs[slot]:
        panel.production_queue.add(ability_id=job.ability, build_progress=job.progress)
        row = world.catalog.row_of_name.get(job.makes)
        if row is not None:
            panel.build_queue.add(
                unit_type=int(types.id[row]), player_relative=Alliance.SELF, build_progress=job.progress
            )


def _write_single(single: ui_pb2.SinglePanel, world: World, types: Types, slot: int, player: int) -> None:
    upgrades = tuple(world.players[int(world.owner[slot])].upgrades)
    attack, armor, shield = types.levels(upgrades)[:, world.type[slot]].tolist()
    single.unit.CopyFrom(_unit(world, types, slot, player))
    single.attack_upgrade_level, single.armor_upgrade_level, single.shield_upgrade_level = attack, armor, shield


def _unit(world: World, types: Types, slot: int, player: int) -> ui_pb2.UnitInfo:
    infos = _Infos(world, types, player)
    infos.write(slot)
    return ui_pb2.UnitInfo.FromString(infos.info.content())


class _Infos:
    """The entries of a panel, written one unit after the other."""

    def __init__(self, world: World, types: Types, player: int) -> None:
        self.c = columns.columns_of(world)
        self.player = player
        self.info = wire.MessageWriter(128)  # a `UnitInfo`
        self.tables = (types.id, world.stats.life_max, world.stats.shields_max, world.stats.energy_max)
        self.type_count = len(types.id)
        self.type_id = memory.ints(types.id)
        self.life_max = memory.floats(world.stats.life_max)  # of every player and type, as the others
        self.shields_max = memory.floats(world.stats.shields_max)
        self.energy_max = memory.floats(world.stats.energy_max)

    def write(self, slot: int) -> None:
        """Write what it says of a unit; points are whole ones."""
        c = self.c
        info = self.info
        owner = c.owner[slot]
        at = owner * self.type_count + c.type[slot]
        life = int(c.life[slot])
        shields = int(c.shields[slot])
        energy = int(c.energy[slot])
        life_max = int(self.life_max[at])
        shields_max = int(self.shields_max[at])
        energy_max = int(self.energy_max[at])
        info.clear()
        info.put_number(fields.INFO_UNIT_TYPE, self.type_id[c.type[slot]])
        info.put_number(fields.INFO_PLAYER_RELATIVE, SELF if owner == self.player else ENEMY if owner else NEUTRAL)
        info.put_number(fields.INFO_HEALTH, life)
        info.put_number(fields.INFO_SHIELDS, shields)
        info.put_number(fields.INFO_ENERGY, energy)
        info.put_number(fields.INFO_TRANSPORT_SLOTS_TAKEN, 0)
        info.put_float(fields.INFO_BUILD_PROGRESS, c.build_progress[slot])
        info.put_number(fields.INFO_MAX_HEALTH, life_max)
        info.put_number(fields.INFO_MAX_SHIELDS, shields_max)
        info.put_number(fields.INFO_MAX_ENERGY, energy_max)
