"""Targets: a unit begins and ends a fight, with the weapon that fits the target.

Used by commands (by order) and by the systems (by its own choice); ``systems.weapons`` decides whether and when it
fires.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_simulator.tables.stats import GROUND_PLANE
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.records import Weapon
    from khala_simulator.world.world import World

WIDEST_AIM_DEG = 180.0


def weapon_for(world: World, slot: int, target: int) -> int:
    """Return the row of the weapon that a unit can aim at ``target`` now, or -1.

    A Colossus is on the ground and in the air: the better of the weapons that fit is aimed at it.
    """
    planes, victim = int(world.plane_bits[target]), world.unit_type(target)
    ground = int(world.ground_weapon[slot]) if planes & GROUND_PLANE else -1
    air = int(world.air_weapon[slot]) if planes != GROUND_PLANE else -1
    weapons = world.catalog.weapons
    row = max(ground, air)
    if min(ground, air) >= 0 and ground != air:
        row = max((ground, air), key=lambda each: weapons[each].rate_against(victim))
    return -1 if row >= 0 and weapons[row].excluding in victim.attributes else row


def engage(world: World, slot: int, target: int) -> bool:
    """Make a unit fight ``target`` with the weapon that fits; return False when it has none."""
    row = weapon_for(world, slot, target)
    if row < 0:
        return False
    if world.target[slot] != target:
        drop_attack(world, slot)
    weapon = world.catalog.weapons[row]
    world.target[slot] = target
    world.weapon[slot] = row
    measure_reach(world, slot)
    bites = world.close_weapon[slot] >= 0
    world.reach_min[slot] = -math.inf if bites or not weapon.min_range else weapon.min_range
    world.slop[slot] = weapon.slop
    world.rolling[slot] = weapon.moves == "moving"
    world.turreted[slot] = weapon.turret_deg_n is not None
    fixed = weapon.turret_deg_n is None and world.unit_type(slot).unturnable
    world.aim_cos[slot] = -1.0 if fixed else aim_cosine(weapon)
    world.nav_loop[slot] = 0
    return True


def aim_cosine(weapon: Weapon) -> float:
    """Return the cosine of how far off its target a weapon may point when it fires."""
    return math.cos(math.radians(min(weapon.arc_deg / 2.0 + weapon.arc_slop_deg, WIDEST_AIM_DEG)))


def take_other_weapon(world: World, slot: int) -> None:
    """Go on with a fight with the weapons of another type, or end it when none fits."""
    drop_attack(world, slot)
    if not engage(world, slot, int(world.target[slot])):
        disengage(world, slot)


def measure_reach(world: World, slot: int) -> None:
    """Write the reach of the weapon at hand, with what buffs add to it or take from it.

    Bodies of some types, such as Siege Tanks and Sentries, keep others farther off than their edges; a unit that
    touches one reaches it.
    """
    plain, more = float(world.stats.range[world.owner[slot], world.weapon[slot]]), float(world.range_add[slot])
    touch, target = 0.0, world.target[slot]
    if target != NOBODY:
        bodies = world.separation[slot] + world.separation[target]
        touch = float(bodies - world.radius[slot] - world.radius[target])
    world.reach[slot] = max(plain + more, min(plain, 0.0), touch)  # reductions leave melee range


def disengage(world: World, slot: int) -> None:
    """Make a unit stop fighting; its shots stay under way."""
    drop_attack(world, slot)
    world.target[slot] = NOBODY
    world.weapon[slot] = -1
    world.rolling[slot] = world.turreted[slot] = False
    world.nav_loop[slot] = 0
    world.scan_now = True


def drop_attack(world: World, slot: int) -> None:
    """Drop an attack that is started and has not taken effect; it leaves no cooldown."""
    world.beaming[slot] = False
    if world.windup[slot] >= 0.0:
        world.windup[slot] = -1.0
        world.cooldown[slot] = 0.0
