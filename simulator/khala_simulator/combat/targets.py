"""Targets: a unit begins and ends a fight, with the weapon that fits the target.

Used by commands (by order) and by the systems (by its own choice); ``systems.weapons`` decides whether and when it
fires.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_simulator.native import columns, memory
from khala_simulator.tables.stats import GROUND_PLANE
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World


def weapon_for(world: World, slot: int, target: int) -> int:
    """Return the row of the weapon that a unit can aim at ``target`` now, or -1.

    A Colossus is on the ground and in the air: the better of the weapons that fit is aimed at it.
    """
    c = columns.columns_of(world)
    planes = c.plane_bits[target]
    ground = c.ground_weapon[slot] if planes & GROUND_PLANE else -1
    air = c.air_weapon[slot] if planes != GROUND_PLANE else -1
    row = max(ground, air)
    if row < 0:
        return -1
    if ground >= 0 and air >= 0 and ground != air:
        weapons = world.catalog.weapons
        victim = world.catalog.units[c.type[target]]
        row = ground if weapons[ground].rate_against(victim) >= weapons[air].rate_against(victim) else air
    stats = world.stats
    is_excluded = memory.ints(stats.excluding)[row] & memory.ints(stats.attribute_bits)[c.type[target]] != 0
    return -1 if is_excluded else row


def engage(world: World, slot: int, target: int) -> bool:
    """Make a unit fight ``target`` with the weapon that fits; return False when it has none."""
    row = weapon_for(world, slot, target)
    if row < 0:
        return False
    c = columns.columns_of(world)
    if c.target[slot] != target:
        drop_attack(world, slot)
        c.reached[slot] = False
        c.in_reach[slot] = False
    c.target[slot] = target
    c.weapon[slot] = row
    measure_reach(world, slot)
    stats = world.stats
    least = memory.floats(stats.least_range)[row]
    c.reach_min[slot] = -math.inf if c.close_weapon[slot] >= 0 or least == 0.0 else least
    c.slop[slot] = memory.floats(stats.slop)[row]
    c.rolling[slot] = memory.bools(stats.rolling)[row]
    c.turreted[slot] = memory.bools(stats.turreted)[row]
    is_fixed = not c.turreted[slot] and memory.bools(stats.unturnable)[c.type[slot]]
    c.aim_cos[slot] = -1.0 if is_fixed else memory.floats(stats.aim_cos)[row]
    c.nav_loop[slot] = 0
    return True


def take_other_weapon(world: World, slot: int) -> None:
    """Go on with a fight with the weapons of another type, or end it when none fits."""
    drop_attack(world, slot)
    if not engage(world, slot, world.target[slot]):
        disengage(world, slot)


def measure_reach(world: World, slot: int) -> None:
    """Write the reach of the weapon at hand, with what buffs add to it or take from it.

    Bodies of some types, such as Siege Tanks and Sentries, keep others farther off than their edges; a unit that
    touches one reaches it.
    """
    c = columns.columns_of(world)
    stats = world.stats
    plain = memory.floats(stats.range)[c.owner[slot] * stats.weapons + c.weapon[slot]]
    touch = 0.0
    target = c.target[slot]
    if target != NOBODY:
        touch = c.separation[slot] + c.separation[target] - c.radius[slot] - c.radius[target]
    c.reach[slot] = max(plain + c.range_add[slot], min(plain, 0.0), touch)  # reductions leave melee range


def disengage(world: World, slot: int) -> None:
    """Make a unit stop fighting; its shots stay under way."""
    drop_attack(world, slot)
    c = columns.columns_of(world)
    c.target[slot] = NOBODY
    c.in_reach[slot] = False
    c.weapon[slot] = -1
    c.rolling[slot] = False
    c.turreted[slot] = False
    c.nav_loop[slot] = 0
    world.scan_now = True


def drop_attack(world: World, slot: int) -> None:
    """Drop an attack that is started and has not taken effect; it leaves no cooldown."""
    c = columns.columns_of(world)
    c.beaming[slot] = False
    c.bursting[slot] = False
    if c.windup[slot] >= 0.0:
        c.windup[slot] = -1.0
        c.cooldown[slot] = 0.0


def inside_zone(c: Columns, slot: int, target: int) -> bool:
    """Return whether a target touches the only circle in which a unit fires; most units fire anywhere."""
    reach = c.zone_radius[slot]
    if reach <= 0.0:
        return True
    middle = c.zone[slot]
    place = c.pos[target]
    return memory.length(place.x - middle.x, place.y - middle.y) <= reach + c.radius[target]
