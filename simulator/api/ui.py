"""`Observation.ui_data`: the panel of the selection, and the control groups.

One selected unit has the single panel, several have the multi panel. Cargo and production panels belong to
transports and to structures that train, which the world does not run yet.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from s2clientprotocol import ui_pb2

from simulator.api.sight import Alliance

if TYPE_CHECKING:
    from simulator.api.selection import Selection
    from simulator.api.types import Types
    from simulator.world import World


def panel(world: World, types: Types, selection: Selection, player: int) -> ui_pb2.ObservationUI:
    """What the interface of a player shows of the selection."""
    ui = ui_pb2.ObservationUI()
    slots = selection.slots(world)
    if len(slots) == 1:
        _write_single(ui.single, world, types, slots[0], player)
    elif slots:
        ui.multi.units.extend(_unit(world, types, slot, player) for slot in slots)
    for index, tags in enumerate(selection.groups):
        if tags:
            leader = int(world.type[world.slot_of(tags[0])])
            ui.groups.add(control_group_index=index, leader_unit_type=int(types.id[leader]), count=len(tags))
    return ui


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
