"""A unit's numbers, looked up once: from its type, its owner and the owner's upgrades into the world's columns."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat.targets import disengage, engage, measure_reach, weapon_for
from khala_simulator.combat.weapon_choice import weapon_traits
from khala_simulator.native import columns, memory
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.layers import ONE_CELL, Layer, inner_body, layer_of
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import AIR_PLANE, ATTRIBUTES, INSTANT_ACCELERATION_N, bit_set
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.buffs import Buff
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.world import World

INSTANT_TURN_DEG: Final = 180.0
ORDINARY_PUSH: Final = 10  # push priority of every type but the wild animals
BUNKER: Final = "Bunker"
DISGUISE: Final = "Changeling"  # types that look armed and are not


def refresh(world: World, slot: int) -> None:
    """Write the traits of a slot from its type, its owner, the owner's upgrades and its buffs."""
    body_traits(world, slot)
    _note(world, slot)


def _note(world: World, slot: int) -> None:
    """Note a unit's changed traits for the systems that skip worlds without such units."""
    c = columns.columns_of(world)
    shields, life, energy = world.regenerating
    world.regenerating = (
        shields or c.shield_regen[slot] != 0.0,
        life or c.life_regen[slot] != 0.0,
        energy or c.energy_regen[slot] != 0.0,
    )
    world.hiding = world.hiding or c.cloaked[slot] or c.burrowed[slot]
    world.census = world.tally = world.casters = None
    world.looked_at = -1
    world.scan_now = True


def set_weapon(world: World, slot: int, weapon: str, *, on: bool) -> None:
    """Switch one of a unit's weapons on or off; a weapon that its type does not have is left alone."""
    for index, found in enumerate(world.unit_type(slot).weapons):
        if found.id == weapon:
            bit = 1 << index
            flips = on == found.disabled  # the type's own setting is no flip
            world.weapon_toggles[slot] = int(world.weapon_toggles[slot]) & ~bit | (bit if flips else 0)
            refresh(world, slot)
            world.scan_now = True


def check_slot(world: World, slot: int) -> None:
    """Refuse a wrong slot: compiled, a rule would write where it should not."""
    if not 0 <= slot < world.top:
        raise IndexError(f"there is no unit in slot {slot}")


def body_traits(world: World, slot: int) -> None:
    """Write all traits of a slot; see the traits of ``columns``."""
    check_slot(world, slot)
    c = columns.columns_of(world)
    unit = world.unit_type(slot)
    kinds = kinds_on(world, slot)
    stats = world.stats
    row = unit.row
    at = c.owner[slot] * stats.types + row
    c.radius[slot] = unit.radius
    c.separation[slot] = unit.separation
    c.lightness[slot] = ORDINARY_PUSH / unit.push
    layer = layer_of(unit)
    c.layer[slot] = layer
    c.clearance[slot] = min(inner_body(unit) - ONE_CELL * (layer is Layer.WIDE), MECHANICS.body_clearance)
    c.layer_bits[slot] = 0 if c.harvest[slot] or unit.underfoot else memory.ints(stats.layer_bits)[row]
    c.plane_bits[slot] = memory.ints(stats.plane_bits)[row]
    c.step_max[slot] = memory.floats(stats.step)[at]
    c.step_gain[slot] = memory.floats(stats.step_gain)[at]
    c.life_max[slot] = memory.floats(stats.life_max)[at]
    c.life_regen[slot] = memory.floats(stats.life_regen)[at]
    c.shields_max[slot] = memory.floats(stats.shields_max)[at]
    c.shield_regen[slot] = memory.floats(stats.shield_regen)[at]
    c.energy_max[slot] = memory.floats(stats.energy_max)[at]
    c.energy_regen[slot] = memory.floats(stats.energy_regen)[at]
    c.life_delay[slot] = unit.life_regen_delay_n * LOOPS_PER_NORMAL_SECOND
    c.shield_delay[slot] = unit.shield_regen_delay_n * LOOPS_PER_NORMAL_SECOND
    _turning(world, slot, unit)
    c.step_loss[slot] = _braking(unit)
    c.glides[slot] = unit.flying and math.isfinite(c.step_loss[slot])
    c.creep_factor[slot] = memory.floats(stats.creep_factor)[at]
    cells = world.footprint_cells(slot)
    c.walled[slot] = len(cells) > 0
    world.walls[slot] = (np.ptp(cells, axis=0) + 1) / 2.0 if len(cells) else 0.0
    c.priority[slot] = unit.priority
    c.targetable[slot] = not (unit.invulnerable or (unit.untargetable and not unit.weapons))
    c.cloaked[slot] = unit.cloaked
    c.sight[slot] = memory.floats(stats.sight)[at]
    c.detects[slot] = unit.detect
    weapon_traits(world, slot, unit, kinds)
    _plain(world, slot)
    for kind in kinds:
        _change(world, slot, kind)
    if kinds or c.build_progress[slot] < 1.0 or not c.powered[slot]:
        _restrain(world, slot, frozenset().union(*[kind.flags for kind in kinds]))
    if unit.name.startswith(DISGUISE):
        c.can_attack[slot] = c.acquires[slot] = False
    if c.carrier[slot] != NOBODY:
        _shelter(world, slot)
    if c.target[slot] != NOBODY:
        _rearm(world, slot, int(c.target[slot]))


def _rearm(world: World, slot: int, target: int) -> None:
    """Go on with a fight as the unit is armed now: another weapon, another range, or none any more."""
    row = weapon_for(world, slot, target)
    if row < 0:
        disengage(world, slot)
    elif int(world.weapon[slot]) not in (row, int(world.close_weapon[slot])):
        engage(world, slot, target)
    else:
        measure_reach(world, slot)


def _shelter(world: World, slot: int) -> None:
    """Make a unit in a Bunker fire from its edge, one farther; no other passenger fires."""
    c = columns.columns_of(world)
    carrier = int(c.carrier[slot])
    if world.unit_type(carrier).name == BUNKER:
        c.radius[slot] = c.radius[carrier]
        c.range_add[slot] += MECHANICS.bunker_range
        for scan in (world.ground_scan, world.air_scan):
            scan[slot] += MECHANICS.bunker_range * (scan[slot] >= 0.0)
    else:
        c.can_attack[slot] = c.acquires[slot] = False


def _turning(world: World, slot: int, unit: UnitType) -> None:
    c = columns.columns_of(world)
    walking_deg = min(unit.turn_deg_n / LOOPS_PER_NORMAL_SECOND, INSTANT_TURN_DEG)
    still_deg = min((unit.turn_still_deg_n or unit.turn_deg_n) / LOOPS_PER_NORMAL_SECOND, INSTANT_TURN_DEG)
    walking, still = math.radians(walking_deg), math.radians(still_deg)
    c.turn_cos[slot] = math.cos(walking)
    c.turn_sin[slot] = math.sin(walking)
    c.turn_still_cos[slot] = math.cos(still)
    c.turn_still_sin[slot] = math.sin(still)


def _braking(unit: UnitType) -> float:
    """Return the speed lost per loop; a type without its own deceleration brakes as it accelerates (an estimate)."""
    rate_n = unit.deceleration_n or unit.acceleration_n
    return math.inf if not 0.0 < rate_n < INSTANT_ACCELERATION_N else rate_n / LOOPS_PER_NORMAL_SECOND**2


def kinds_on(world: World, slot: int) -> list[Buff]:
    """Return the kinds of buffs on a unit, in the order in which they came."""
    if not len(world.buffs):
        return []
    return [world.catalog.buffs[row] for row in world.buffs.of(slot)["buff"].tolist()]


# buffs ----------------------------------------------------------------------------------------------------------------


def _plain(world: World, slot: int) -> None:
    """Write the traits of a unit without any buff."""
    c = columns.columns_of(world)
    c.attack_rate[slot] = c.taken_factor[slot] = c.dealt_factor[slot] = c.air_taken_factor[slot] = 1.0
    c.range_add[slot] = c.armor_add[slot] = c.shield_armor_add[slot] = c.ranged_add[slot] = c.melee_add[slot] = 0.0
    c.work_rate[slot] = 1.0
    if "god" in world.players[int(c.owner[slot])].cheats:
        c.taken_factor[slot] = 0.0
    c.can_act[slot] = c.can_attack[slot] = c.can_cast[slot] = True
    c.bonus_bits[slot] = 0
    c.bonus_add[slot] = 0.0
    if c.hallucination[slot]:
        at = (int(c.owner[slot]), int(c.type[slot]))
        c.dealt_factor[slot] = 0.0
        c.armor_add[slot], c.shield_armor_add[slot] = -world.stats.armor[at], -world.stats.shield_armor[at]


def _change(world: World, slot: int, buff: Buff) -> None:
    """Apply the numbers of one buff."""
    second = LOOPS_PER_NORMAL_SECOND
    owner = int(world.owner[slot])
    upgraded = world.stats.with_upgrades
    speed = upgraded(owner, "behavior", buff.name, "Modification.MoveSpeedMultiplier", buff.speed)
    gain = upgraded(owner, "behavior", buff.name, "Modification.AccelerationMultiplier", buff.acceleration)
    world.step_max[slot] = (world.step_max[slot] + buff.speed_add_n / second) * speed * buff.time
    if buff.speed_max_n is not None:
        world.step_max[slot] = min(float(world.step_max[slot]), buff.speed_max_n / second)
    world.step_gain[slot] = world.step_gain[slot] * gain + buff.acceleration_add_n / second**2
    world.step_loss[slot] += buff.deceleration_add_n / second**2
    world.attack_rate[slot] *= buff.attack_rate * buff.time
    world.work_rate[slot] *= buff.work_rate * buff.time
    world.range_add[slot] += buff.range_add
    world.armor_add[slot] += buff.armor_add
    world.shield_armor_add[slot] += buff.shield_armor_add
    world.sight[slot] += buff.sight_add
    world.detects[slot] = max(float(world.detects[slot]), buff.detect)
    world.life_max[slot] += buff.life_max_add
    world.life_regen[slot] += buff.life_regen_n / second
    world.shield_regen[slot] += buff.shields_regen_n / second
    world.energy_regen[slot] += buff.energy_regen_n / second
    for name, amount in buff.bonus:
        world.bonus_bits[slot] |= bit_set((name,), ATTRIBUTES)
        world.bonus_add[slot] = amount
    if buff.dealt_fraction:
        world.dealt_factor[slot] *= dict(buff.dealt_fraction).get("Ranged", 1.0)
    response = buff.response
    if response is not None and response.from_air:
        world.air_taken_factor[slot] *= response.factor
    elif response is not None and response.on == "defender" and not response.limit:
        world.ranged_add[slot] += response.add * ("ranged" not in response.not_kinds)
        world.melee_add[slot] += response.add * ("melee" not in response.not_kinds)
        world.taken_factor[slot] *= response.factor


def _unground(world: World, slot: int, flags: frozenset[str]) -> None:
    """Take a unit's body out of the way, or the unit off the ground, where buffs do that."""
    if "bodiless" in flags:
        world.layer_bits[slot] = 0
    if "lifted" in flags:
        world.plane_bits[slot] = AIR_PLANE


def _restrain(world: World, slot: int, flags: frozenset[str]) -> None:
    """Apply the limits that buffs, construction and a lack of power put on a unit."""
    unfinished = world.build_progress[slot] < 1.0
    helpless = unfinished or not world.powered[slot] or bool(flags & {"stunned", "stasis"})
    world.can_act[slot] = not (helpless or "uncommandable" in flags)
    world.can_cast[slot] = not (helpless or "silenced" in flags)
    world.can_attack[slot] = not (helpless or "disarmed" in flags)
    if not world.can_attack[slot] or "passive" in flags:
        world.acquires[slot] = False
    if helpless or "rooted" in flags:
        world.step_max[slot] = 0.0
    if helpless or "unturning" in flags:
        world.turn_cos[slot], world.turn_sin[slot] = 1.0, 0.0
        world.turn_still_cos[slot], world.turn_still_sin[slot] = 1.0, 0.0
    if flags & {"invulnerable", "stasis"}:
        world.targetable[slot] = False
    world.cloaked[slot] = (world.cloaked[slot] or "cloak" in flags) and not (unfinished or "uncloaked" in flags)
    if "blind" in flags or unfinished:
        world.detects[slot] = 0.0
    _unground(world, slot, flags)
    for name, column in (
        ("no_life_regen", world.life_regen),
        ("no_shield_regen", world.shield_regen),
        ("no_energy_regen", world.energy_regen),
    ):
        if name in flags or unfinished:
            column[slot] = 0.0
    if unfinished and world.unit_type(slot).structure:
        world.sight[slot] = MECHANICS.building_sight
