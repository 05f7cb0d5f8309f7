"""`Observation.ui_data`: the panel of the selection, and the control groups.

Several selected units have the multi panel; one has the production panel when it makes something, the cargo panel when
it has passengers, and else the single panel.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from s2clientprotocol import ui_pb2

from khala_simulator import compiled
from khala_simulator.api.sight import Alliance

if TYPE_CHECKING:
    from khala_simulator.api.selection import Selection
    from khala_simulator.api.types import Types
    from khala_simulator.world.world import World


def panel(world: World, types: Types, selection: Selection, player: int) -> ui_pb2.ObservationUI:
    """Return what a player's interface shows of the selection."""
    ui = ui_pb2.ObservationUI()
    slots = selection.slots(world)
    if len(slots) == 1:
        _write_one(ui, world, types, slots[0], player)
    elif slots:
        ui.multi.MergeFromString(_encode_multi(world, types, slots, player))
    for index, tags in enumerate(selection.groups):
        if tags:
            leader = int(world.type[world.slot_of(tags[0])])
            ui.groups.add(control_group_index=index, leader_unit_type=int(types.id[leader]), count=len(tags))
    return ui


def _encode_multi(world: World, types: Types, slots: list[int], player: int) -> bytes:
    """Return a `MultiPanel`; `compiled.units` writes it without an object for each unit."""
    kernel = compiled.part("units")
    if kernel is not None:
        encoded: bytes = kernel.encode_panel(world, types, slots, player)
        return encoded
    return multi_panel(world, types, slots, player).SerializeToString()


def multi_panel(world: World, types: Types, slots: list[int], player: int) -> ui_pb2.MultiPanel:
    """Return the panel of several units."""
    return ui_pb2.MultiPanel(units=(_unit(world, types, slot, player) for slot in slots))


def _write_one(ui: ui_pb2.ObservationUI, world: World, types: Types, slot: int, player: int) -> None:
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
    owner, row = int(world.owner[slot]), int(world.type[slot])
    at = (owner, row)
    stats = world.stats
    side = Alliance.SELF if owner == player else Alliance.NEUTRAL if owner == 0 else Alliance.ENEMY
    return ui_pb2.UnitInfo(
        unit_type=int(types.id[row]),
        player_relative=side,
        health=int(world.life[slot]),
        shields=int(world.shields[slot]),
        energy=int(world.energy[slot]),
        transport_slots_taken=0,
        build_progress=float(world.build_progress[slot]),
        max_health=int(stats.life_max[at]),
        max_shields=int(stats.shields_max[at]),
        max_energy=int(stats.energy_max[at]),
    )
