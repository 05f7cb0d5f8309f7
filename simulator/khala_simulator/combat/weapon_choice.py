"""Armament: which weapons a unit can use now, as traits of its slot.

A type's weapons that are switched off can be switched on, and the other way round, by a buff (an Oracle's beam) or by
the unit's own setting (a Baneling that blows up structures). The usable weapon with the longest range is aimed; a
hidden one with a shorter range takes over when the target stands close, as a Roach's bite does. ``traits`` calls this,
``targets`` picks from what it writes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.native import columns, memory
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.stats import AIR_PLANE, GROUND_PLANE

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.tables.buffs import Buff
    from khala_simulator.tables.records import UnitType, Weapon
    from khala_simulator.world.world import World

NO_SCAN: Final = -1.0
NO_WEAPON: Final = -1
WIDEST_TURN_DEG: Final = 180.0


def usable_weapons(world: World, slot: int, kinds: Iterable[Buff] = ()) -> list[Weapon]:
    """Return the weapons that are switched on and do something, the longest range first."""
    toggles = int(world.weapon_toggles[slot])
    on = {name for kind in kinds for name in kind.weapons_on}
    off = {name for kind in kinds for name in kind.weapons_off}
    usable = [
        weapon
        for index, weapon in enumerate(world.unit_type(slot).weapons)
        if weapon.works and weapon.id not in off and (weapon.id in on or weapon.disabled == bool(toggles >> index & 1))
    ]
    return sorted(usable, key=lambda weapon: -weapon.range)


def weapon_traits(world: World, slot: int, unit: UnitType, kinds: Iterable[Buff]) -> None:
    """Write the weapon traits of a slot; see ``columns``."""
    c = columns.columns_of(world)
    weapons = usable_weapons(world, slot, kinds)
    owner = c.owner[slot]
    stats = world.stats
    scan = memory.floats(stats.scan)
    first = owner * stats.weapons
    ground = _first_that_reaches(weapons, "ground")
    air = _first_that_reaches(weapons, "air")
    close = None if ground is None else _closer_weapon(weapons, ground)
    c.ground_weapon[slot] = NO_WEAPON if ground is None else ground.row
    c.air_weapon[slot] = NO_WEAPON if air is None else air.row
    c.close_weapon[slot] = NO_WEAPON if close is None else close.row
    c.close_range[slot] = 0.0 if close is None else close.range
    c.least_range[slot] = 0.0 if ground is None or close is not None else ground.min_range
    c.ground_scan[slot] = NO_SCAN if ground is None else scan[first + ground.row]
    c.air_scan[slot] = NO_SCAN if air is None else scan[first + air.row]
    turrets = [w.turret_deg_n for w in weapons if w.turret_deg_n is not None]
    by_itself = bool(turrets) or not unit.passive
    c.acquires[slot] = bool(weapons) and by_itself and not unit.uncommandable and owner != 0
    planes = (GROUND_PLANE if ground is not None else 0) | (AIR_PLANE if air is not None else 0)
    c.threat_bits[slot] = GROUND_PLANE | AIR_PLANE if unit.always_threatens else planes
    c.defensive[slot] = unit.defensive or (unit.passive and not unit.always_threatens)
    c.flees[slot] = unit.flees and not unit.passive
    c.guns_walking[slot] = bool([w for w in weapons if w.fires_moving and w.moves == "moving"])
    aimed_at_all = [w for w in weapons if w.acquires != "unit" and w.excluding != "structure"]
    c.spares_structures[slot] = bool(weapons) and not aimed_at_all
    turn = math.radians(min((turrets[0] if turrets else 0.0) / LOOPS_PER_NORMAL_SECOND, WIDEST_TURN_DEG))
    c.turret_cos[slot] = math.cos(turn)
    c.turret_sin[slot] = math.sin(turn)


def _first_that_reaches(weapons: list[Weapon], plane: str) -> Weapon | None:
    for weapon in weapons:
        if weapon.reaches(plane):
            return weapon
    return None


def _closer_weapon(weapons: list[Weapon], ground: Weapon) -> Weapon | None:
    """Return the hidden weapon that takes over when the target stands close."""
    for weapon in weapons:
        if weapon.hidden and weapon.range < ground.range:
            return weapon
    return None
