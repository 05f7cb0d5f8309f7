"""A unit's numbers, looked up once: from its type, its owner and the owner's upgrades into the world's columns."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import TYPE_CHECKING, Final

from simulator.catalog import LOOPS_PER_NORMAL_SECOND
from simulator.mechanics import MECHANICS

if TYPE_CHECKING:
    from simulator.records import UnitType
    from simulator.world import World

INSTANT_TURN_DEG: Final = 180.0
NO_SCAN: Final = -1.0


class Layer(IntEnum):
    """On what a unit moves: the ground, the ground and its cliffs, or the air."""

    WALK = 0
    GLIDE = 1
    AIR = 2


def layer_of(unit: UnitType) -> Layer:
    """The layer on which units of this type move."""
    if unit.flying:
        return Layer.AIR
    return Layer.GLIDE if unit.mover in ("colossus", "cliffjumper") else Layer.WALK


def body_traits(world: World, slot: int) -> None:
    """Write all traits of a slot; see the traits of ``columns``."""
    unit = world.unit_type(slot)
    at = (int(world.owner[slot]), unit.row)
    turn_deg = unit.turn_deg_n / LOOPS_PER_NORMAL_SECOND
    turn = math.radians(min(turn_deg, INSTANT_TURN_DEG))
    world.radius[slot] = unit.radius
    world.separation[slot] = unit.separation
    world.clearance[slot] = min(unit.separation if unit.inner is None else unit.inner, MECHANICS.body_clearance)
    world.layer[slot] = layer_of(unit)
    world.layer_bits[slot] = world.stats.layer_bits[unit.row]
    world.plane_bits[slot] = world.stats.plane_bits[unit.row]
    world.step_max[slot] = world.stats.step[at]
    world.step_gain[slot] = world.stats.step_gain[at]
    world.life_max[slot], world.life_regen[slot] = world.stats.life_max[at], world.stats.life_regen[at]
    world.shields_max[slot], world.shield_regen[slot] = world.stats.shields_max[at], world.stats.shield_regen[at]
    world.energy_max[slot], world.energy_regen[slot] = world.stats.energy_max[at], world.stats.energy_regen[at]
    world.life_delay[slot] = unit.life_regen_delay_n * LOOPS_PER_NORMAL_SECOND
    world.shield_delay[slot] = unit.shield_regen_delay_n * LOOPS_PER_NORMAL_SECOND
    world.turn_cos[slot], world.turn_sin[slot] = math.cos(turn), math.sin(turn)
    world.creep_factor[slot] = unit.creep_factor
    world.walled[slot] = len(world.footprint_cells(slot)) > 0
    world.priority[slot] = unit.priority
    world.targetable[slot] = not (unit.untargetable or unit.invulnerable)
    _weapon_traits(world, slot, unit)


def _weapon_traits(world: World, slot: int, unit: UnitType) -> None:
    owner = int(world.owner[slot])
    ground, air = unit.weapon_against("ground"), unit.weapon_against("air")
    world.ground_weapon[slot] = -1 if ground is None else ground.row
    world.air_weapon[slot] = -1 if air is None else air.row
    world.ground_scan[slot] = NO_SCAN if ground is None else world.stats.scan[owner, ground.row]
    world.air_scan[slot] = NO_SCAN if air is None else world.stats.scan[owner, air.row]
    armed = ground is not None or air is not None
    world.acquires[slot] = armed and not (unit.defensive or unit.uncommandable) and owner != 0
