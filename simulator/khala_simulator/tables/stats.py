"""The tables as arrays, one row per player, with the player's upgrades applied.

``catalog`` says what a type is; this module says what it is *for this player now*. The systems gather from these arrays
by ``[owner, row]``. Recomputed for a player when an upgrade is done, never in between.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.catalog import Catalog, Hit, UnitType, Weapon
    from khala_simulator.tables.records import Change

ATTRIBUTES: Final = (
    "light", "armored", "biological", "mechanical", "robotic", "psionic", "massive", "structure",
    "hover", "heroic", "summoned", "user1", "mapboss",
)  # fmt: skip
LAYERS: Final = (
    "ground", "structure", "burrow", "roachburrow", "forcefield", "locust", "phased", "flying", "colossus",
    "flyingescorts", "locustforcefield", "disruptorphased", "air4", "larva", "creeptumor", "small",
)  # fmt: skip
GROUND_PLANE: Final = 1
AIR_PLANE: Final = 2
INSTANT_ACCELERATION_N: Final = 1000.0
WIDEST_AIM_DEG: Final = 180.0


MORPH_TIME: Final = (
    "InfoArray[0].SectionArray[Stats].DurationArray[Delay]",
    "InfoArray[0].SectionArray[Stats].DurationArray[Duration]",
)
READ: Final = {
    "unit": {
        "Acceleration", "EnergyMax", "EnergyStart", "LifeArmor", "LifeMax", "LifeRegenRate", "LifeStart", "ShieldArmor",
        "ShieldsMax", "Sight", "Speed", "SpeedMultiplierCreep",
    },
    "weapon": {"MinScanRange", "Range", "RateMultiplier"},
    "effect": {"Amount"},
    "behavior": {
        "Modification.MoveSpeedMultiplier", "Modification.AccelerationMultiplier",
        "Modification.StateFlags[SuppressCloak]",
    },
    "abil": {"Range[0]", "AutoCastRange", "Cost[0].Cooldown.TimeUse", "InfoArray[0].RandomDelayMax", *MORPH_TIME},
}  # fmt: skip
"""The fields whose changes by upgrades have an effect here; attribute bonuses of effects as well."""


def reads(change: Change) -> bool:
    """Return whether a change that an upgrade makes has an effect."""
    bonus = change.catalog == "effect" and change.field.startswith("AttributeBonus[")
    return bonus or change.field in READ.get(change.catalog, ())


CHANGED: Final = (
    "life_max", "shields_max", "energy_max", "energy_start", "armor", "shield_armor", "sight", "step", "creep_factor",
    "step_gain", "life_regen", "shield_regen", "energy_regen", "range", "scan", "period",
)  # fmt: skip
"""What upgrades change, of those with a row for each player."""


class Damage:
    """A hit's amounts after upgrades.

    Attributes:
        hit: As the catalog has it.
        amount: Without bonus.
        bonus: ``(attribute bit, amount)`` for each.
        kind: Of the hit.
        ignores_armor: Of the hit.
        plain: Whether it hurts its target alone.
        follows: Whether it bounces from the hit before.
        delay: Loops after the damage point; none for a sweep, whose points have their own.
        conditional: Whether the game's own switch decides about it.
    """

    def __init__(self, hit: Hit, amount: float, bonus: tuple[tuple[int, float], ...]) -> None:
        self.hit = hit
        self.amount = amount
        self.bonus = bonus
        self.kind = hit.kind
        self.ignores_armor = hit.ignores_armor
        self.follows = hit.bounce
        self.delay = 0.0 if hit.sweep is not None else hit.delay_loops
        self.conditional = bool(hit.when)
        self.plain = not (hit.kills_self or hit.area or (hit.search is not None and not hit.bounce))


def bit_set(names: Iterable[str], order: tuple[str, ...]) -> int:
    """Return the bit set of ``names``, bit i for ``order[i]``."""
    return sum(1 << order.index(name) for name in set(names))


class Stats:
    """Arrays ``[player, unit row]`` and ``[player, weapon row]``; see each line for the unit."""

    def __init__(self, catalog: Catalog, players: int) -> None:
        self.catalog = catalog
        self.weapons = len(catalog.weapons)
        self.types = len(catalog.units)
        shape_u = (players, len(catalog.units))
        shape_w = (players, self.weapons)
        self.life_max: Floats = np.zeros(shape_u)
        self.shields_max: Floats = np.zeros(shape_u)
        self.energy_max: Floats = np.zeros(shape_u)
        self.energy_start: Floats = np.zeros(shape_u)
        self.armor: Floats = np.zeros(shape_u)
        self.shield_armor: Floats = np.zeros(shape_u)
        self.sight: Floats = np.zeros(shape_u)
        self.step: Floats = np.zeros(shape_u)  # world units per loop
        self.creep_factor: Floats = np.ones(shape_u)  # times this on creep
        self.step_gain: Floats = np.zeros(shape_u)  # world units per loop, gained per loop; inf is at once
        self.life_regen: Floats = np.zeros(shape_u)  # per loop
        self.shield_regen: Floats = np.zeros(shape_u)  # per loop
        self.energy_regen: Floats = np.zeros(shape_u)  # per loop
        self.range: Floats = np.zeros(shape_w)  # edge to edge
        self.scan: Floats = np.zeros(shape_w)  # edge to edge
        self.period: Floats = np.zeros(shape_w)  # loops
        self.damage: list[list[tuple[Damage, ...]]] = [[() for _ in catalog.weapons] for _ in range(players)]
        self.attribute_bits: NDArray[np.int64] = np.array([bit_set(u.attributes, ATTRIBUTES) for u in catalog.units])
        self.layer_bits: NDArray[np.int64] = np.array([bit_set(u.collide, LAYERS) for u in catalog.units])
        self.plane_bits: NDArray[np.int64] = np.array([_plane_bits(u) for u in catalog.units])
        self.beam: NDArray[np.bool_] = np.array([w.is_beam for w in catalog.weapons])
        self.bursts: NDArray[np.bool_] = np.array([w.bursts for w in catalog.weapons])
        self.kamikaze: NDArray[np.bool_] = np.array([w.is_kamikaze for w in catalog.weapons])
        self.backswing: Floats = np.array([w.backswing_loops for w in catalog.weapons], dtype=np.float64)
        self.damage_point: Floats = np.array([w.damage_point_loops for w in catalog.weapons], dtype=np.float64)
        self.least_range: Floats = np.array([w.min_range for w in catalog.weapons], dtype=np.float64)
        self.slop: Floats = np.array([w.slop for w in catalog.weapons], dtype=np.float64)
        self.rolling: NDArray[np.bool_] = np.array([w.moves == "moving" for w in catalog.weapons])
        self.turreted: NDArray[np.bool_] = np.array([w.turret_deg_n is not None for w in catalog.weapons])
        self.aim_cos: Floats = np.array([_aim_cosine(w) for w in catalog.weapons], dtype=np.float64)
        self.excluding: NDArray[np.int64] = np.array([_excluded_bits(w) for w in catalog.weapons])
        self.has_turret: NDArray[np.bool_] = _have(catalog, self.turreted)
        self.has_beam: NDArray[np.bool_] = _have(catalog, self.beam)
        self.has_rolling_gun: NDArray[np.bool_] = _have(catalog, self.rolling)
        self.unturnable: NDArray[np.bool_] = np.array([u.unturnable for u in catalog.units])
        self.uncommandable: NDArray[np.bool_] = np.array([u.uncommandable for u in catalog.units])
        self.untargetable: NDArray[np.bool_] = np.array([u.untargetable for u in catalog.units])
        self.jitter: Floats = np.array([w.jitter_loops for w in catalog.weapons], dtype=np.float64)  # (weapons, 2)
        self._changes: list[_Changes] = [_Changes(catalog, ()) for _ in range(players)]
        self._abilities: list[dict[int, Ability]] = [{} for _ in range(players)]
        for player in range(players):
            self.apply(player, ())

    def copy(self) -> Stats:
        """Return stats of their own with the same numbers; what no upgrade changes is shared."""
        twin: Stats = copy.copy(self)
        for name in CHANGED:
            setattr(twin, name, getattr(self, name).copy())
        twin._changes = self._changes.copy()
        twin.damage = [weapons.copy() for weapons in self.damage]
        twin._abilities = [abilities.copy() for abilities in self._abilities]
        return twin

    def apply(self, player: int, upgrades: Iterable[int]) -> None:
        """Recompute the rows of ``player`` for exactly these upgrade ids."""
        changes = self._changes[player] = _Changes(self.catalog, upgrades)
        self._abilities[player] = {
            a.id: _ability(a, changes) for a in self.catalog.abilities if a.link in changes.links
        }
        for unit in self.catalog.units:
            self._apply_unit(player, unit, changes)
        for weapon in self.catalog.weapons:
            self._apply_weapon(player, weapon, changes)

    def ability(self, player: int, ability: Ability) -> Ability:
        """Return the ability as a player has it now, with the range, cooldown and times that upgrades change."""
        return self._abilities[player].get(ability.id, ability)

    def with_upgrades(self, player: int, catalog: str, entry: str, field: str, base: float) -> float:
        """Return a number of the game's data with the player's upgrades applied; in the data's own unit."""
        return self._changes[player].value(catalog, entry, field, base)

    def _apply_unit(self, player: int, unit: UnitType, changes: _Changes) -> None:
        def value(field: str, base: float) -> float:
            return changes.value("unit", unit.name, field, base)

        at = (player, unit.row)
        second = LOOPS_PER_NORMAL_SECOND
        acceleration = value("Acceleration", unit.acceleration_n)
        self.life_max[at] = value("LifeMax", unit.life)
        self.shields_max[at] = value("ShieldsMax", unit.shields)
        self.energy_max[at] = value("EnergyMax", unit.energy)
        self.energy_start[at] = value("EnergyStart", unit.energy_start)
        self.armor[at] = value("LifeArmor", unit.armor)
        self.shield_armor[at] = value("ShieldArmor", unit.shield_armor)
        self.sight[at] = value("Sight", unit.sight)
        self.step[at] = value("Speed", unit.speed_n) / second
        self.creep_factor[at] = value("SpeedMultiplierCreep", unit.creep_factor)
        self.step_gain[at] = math.inf if acceleration >= INSTANT_ACCELERATION_N else acceleration / second**2
        self.life_regen[at] = value("LifeRegenRate", unit.life_regen_n) / second
        self.shield_regen[at] = unit.shield_regen_n / second
        self.energy_regen[at] = unit.energy_regen_n / second

    def _apply_weapon(self, player: int, weapon: Weapon, changes: _Changes) -> None:
        at = (player, weapon.row)
        self.range[at] = changes.value("weapon", weapon.id, "Range", weapon.range)
        scan = changes.value("weapon", weapon.id, "MinScanRange", weapon.scan)
        self.scan[at] = max(scan, self.range[at] + MECHANICS.scan_margin)
        rate = changes.value("weapon", weapon.id, "RateMultiplier", 1.0)
        self.period[at] = weapon.period_loops / rate
        self.damage[player][weapon.row] = tuple(_damage(hit, changes) for hit in weapon.hits)


@functools.lru_cache(maxsize=16)
def _plain(catalog: Catalog, players: int) -> Stats:
    return Stats(catalog, players)


def new_stats(catalog: Catalog, players: int) -> Stats:
    """Return stats without upgrades; a copy takes a twentieth of the time, and each episode has its own."""
    return _plain(catalog, players).copy()


class _Changes:
    """The changes of some upgrades, indexed by what they change."""

    def __init__(self, catalog: Catalog, upgrades: Iterable[int]) -> None:
        wanted = sorted(set(upgrades))
        self._by_field: dict[tuple[str, str, str], list[tuple[str, float]]] = {}
        for upgrade in (catalog.upgrade(u) for u in wanted):
            for change in upgrade.changes:
                if isinstance(change.value, int | float):
                    key = (change.catalog, change.entry, change.field)
                    self._by_field.setdefault(key, []).append((change.op, float(change.value)))
        self.links = {entry for catalog, entry, _ in self._by_field if catalog == "abil"}

    def value(self, catalog: str, entry: str, field: str, base: float) -> float:
        for op, amount in self._by_field.get((catalog, entry, field), ()):
            if op == "add":
                base += amount
            elif op == "subtract":
                base -= amount
            else:
                base = amount
        return base

    def added_bonuses(self, effect: str) -> list[str]:
        prefix = "AttributeBonus["
        fields = (f for c, e, f in self._by_field if c == "effect" and e == effect)
        return [f[len(prefix) : -1].lower() for f in fields if f.startswith(prefix)]


def _ability(ability: Ability, changes: _Changes) -> Ability:
    """Return an ability with changed range, cooldown and morphing time; the data's times are normal seconds."""

    def value(field: str, base: float) -> float:
        return changes.value("abil", ability.link, field, base)

    second = LOOPS_PER_NORMAL_SECOND
    return dataclasses.replace(
        ability,
        range=value("Range[0]", ability.range),
        autocast_range=value("AutoCastRange", ability.autocast_range),
        cooldown_loops=value("Cost[0].Cooldown.TimeUse", ability.cooldown_loops / second) * second,
        loops=max(ability.loops + sum(value(field, 0.0) for field in MORPH_TIME) * second, 0.0),
        random_loops=max(value("InfoArray[0].RandomDelayMax", ability.random_loops / second) * second, 0.0),
    )


def _damage(hit: Hit, changes: _Changes) -> Damage:
    bonus = dict(hit.bonus)
    for attribute in changes.added_bonuses(hit.effect):
        bonus.setdefault(attribute, 0.0)
    upgraded = tuple(
        (
            1 << ATTRIBUTES.index(name),
            changes.value("effect", hit.effect, f"AttributeBonus[{name.capitalize()}]", amount),
        )
        for name, amount in sorted(bonus.items())
    )
    return Damage(hit, changes.value("effect", hit.effect, "Amount", hit.damage), upgraded)


def _aim_cosine(weapon: Weapon) -> float:
    """Return the cosine of how far off its target a weapon may point when it fires."""
    return math.cos(math.radians(min(weapon.arc_deg / 2.0 + weapon.arc_slop_deg, WIDEST_AIM_DEG)))


def _excluded_bits(weapon: Weapon) -> int:
    """Return the attribute that a weapon can't be aimed at, as a bit."""
    return bit_set([weapon.excluding] if weapon.excluding else [], ATTRIBUTES)


def _have(catalog: Catalog, are: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which types of units have a weapon of a kind, of which it is said which weapons ``are``."""
    return np.array([any(are[weapon.row] for weapon in unit.weapons) for unit in catalog.units])


def _plane_bits(unit: UnitType) -> int:
    planes = unit.planes or (("air",) if unit.flying else ("ground",))
    return (GROUND_PLANE if "ground" in planes else 0) | (AIR_PLANE if "air" in planes else 0)
