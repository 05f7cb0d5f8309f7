"""Every weapon of both game versions: what an attack takes, how many kill, and how fast they follow each other.

The expectations are computed here from the tables alone, with none of the rules' code.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat.traits import set_weapon
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.world.players import PlayerSetup
from khala_simulator.world.world import World

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.tables.records import Hit, UnitType, Weapon

VERSIONS = ("4.10", "5.0.13")
LIFE, SHIELDS = 60.0, 30.0
NO_OWN_ATTACK = {"90mmCannonsFake", "CycloneFakeWeapon", "PointDefenseLaser"}  # they only aim, or shoot missiles down
RHYTHM_OF_THEIR_OWN = {"VolatileBurst", "VolatileBurstBuilding", "BroodlingEscort", "ImpalerTentacle"}
GAPS = 8


@dataclass(frozen=True)
class Case:
    version: str
    unit: str
    weapon: str


def cases() -> list[Any]:
    """Return one carrier of every damaging weapon, per version; further ones of a kind are in the long tests."""
    found: dict[tuple[str, str], Any] = {}
    shown: set[object] = set()
    for version in VERSIONS:
        for unit in load_catalog(version).units:
            for weapon in unit.weapons:
                if weapon.hits and weapon.id not in NO_OWN_ATTACK and not (unit.passive or unit.uncommandable):
                    if (version, weapon.id) in found:
                        continue
                    marks = [pytest.mark.slow] if kind(weapon) in shown else []
                    shown.add(kind(weapon))
                    case = Case(version, unit.name, weapon.id)
                    found[version, weapon.id] = pytest.param(case, id=f"{version}-{weapon.id}", marks=marks)
    return list(found.values())


def kind(weapon: Weapon) -> object:
    """Return the rules of a weapon's attack, without its numbers."""
    hits = {
        (
            h.when,
            h.ignores_armor,
            bool(h.bonus),
            h.bounce,
            h.search is None,
            h.sweep is None,
            bool(h.area),
            h.kills_self,
        )
        for h in weapon.hits
    }
    planes = tuple(weapon.reaches(plane) for plane in ("ground", "air"))
    return (
        planes,
        weapon.is_beam,
        weapon.is_kamikaze,
        weapon.disabled,
        weapon.range > 0.1,
        len(weapon.hits),
        frozenset(hits),
    )


def test_no_weapon_that_deals_damage_is_left_out() -> None:
    for version in VERSIONS:
        catalog = load_catalog(version)
        tried = {p.values[0].weapon for p in cases() if p.values[0].version == version}
        carried = {w.id for u in catalog.units if not (u.passive or u.uncommandable) for w in u.weapons if w.hits}
        assert tried == carried - NO_OWN_ATTACK
        assert len(tried) > 60


class Duel:
    """An attacker with one weapon before a target that does nothing and does not heal."""

    def __init__(self, make_field: Callable[..., Any], case: Case) -> None:
        self.field = make_field()
        catalog = load_catalog(case.version)
        players = (PlayerSetup(1, "protoss", "agent"), PlayerSetup(2, "zerg", "computer"))
        world = self.world = self.field.world = World(self.field.world.map, players, catalog=catalog)
        self.weapon: Weapon = next(w for w in catalog.weapons if w.id == case.weapon)
        self.attacker_type: UnitType = catalog.unit(case.unit)
        self.target_type = catalog.unit("Stalker" if self.weapon.reaches("ground") else "Carrier")
        gap = min(max(0.9 * self.weapon.range, self.weapon.min_range + 0.2), self.weapon.range)
        away = self.attacker_type.radius + self.target_type.radius + gap
        self.target = self.field.put(self.target_type.name, 2, 8 + away, 16)
        self.attacker = self.field.put(case.unit, 1, 8, 16)
        if self.attacker_type.needs_power:
            self.field.put("Pylon", 1, 8, 20)
        if self.weapon.disabled:
            set_weapon(world, self.attacker, self.weapon.id, on=True)
        world.acquires[self.target] = world.acquires[self.attacker] = False
        world.step_max[self.target] = world.step_max[self.attacker] = 0.0
        for rate in (world.life_regen, world.shield_regen):
            rate[self.target] = 0.0
        commands.attack_unit(world, [self.attacker], world.tag_of(self.target))

    def attack(self) -> tuple[float, float]:
        """Play one attack with all its effects; return what it took from shields and life."""
        world, slot = self.world, self.attacker
        shields, life = float(world.shields[self.target]), float(world.life[self.target])
        world.cooldown[slot] = 0.0
        for _ in self.field.loops(40):
            if world.cooldown[slot] > 0.0:
                break
        world.cooldown[slot] = 1e6
        self.field.play(math.ceil(self.weapon.damage_point_loops) + 50)
        if not world.alive[self.target]:
            return shields, life
        return shields - float(world.shields[self.target]), life - float(world.life[self.target])


def strikes(duel: Duel) -> list[tuple[float, bool]]:
    """Return what one attack does to its target, hit by hit: damage before armor, and whether armor counts."""
    unit = duel.target_type
    taken = [branch(hit, duel.weapon, unit) for hit in duel.weapon.hits]
    return [
        (hit.damage + max((v for a, v in hit.bonus if a in unit.attributes), default=0.0), not hit.ignores_armor)
        for hit, happens in zip(duel.weapon.hits, taken, strict=True)
        if happens and on_target(hit)
    ]


def branch(hit: Hit, weapon: Weapon, unit: UnitType) -> bool:
    """Return whether the game's switch comes to this hit for an enemy of this type."""
    facts = {
        "": True,
        "GroundUnitFilter": not unit.flying,
        "TargetRadiusSmall": unit.radius < 1.25,
        "TargetRadiusLarge": unit.radius >= 1.25,
    }
    if hit.when == "else":
        return not any(facts.get(h.when, False) for h in weapon.hits if h.when not in ("", "else"))
    return facts.get(hit.when, False)


def on_target(hit: Hit) -> bool:
    if hit.bounce or hit.search is not None or hit.kills_self:
        return False
    if hit.sweep is not None:
        return not hit.sweep.affects.not_target
    return not (hit.area and hit.area_affects.only == "structure")


def struck(unit: UnitType, shields: float, life: float, damage: float, armored: bool) -> tuple[float, float]:
    """Shields and life after one hit, by the rule of the game's data: shields first, armor of each, at least 0.5."""
    rest = damage
    if shields > 0.0:
        reduced = max(damage - (unit.shield_armor if armored else 0.0), 0.5)
        absorbed = min(shields, reduced)
        shields, rest = shields - absorbed, reduced - absorbed
    if rest > 0.0:
        life -= max(rest - (unit.armor if armored else 0.0), 0.5)
    return shields, max(life, 0.0)


@pytest.mark.parametrize("case", [p for p in cases() if p.values[0].weapon != "ImpalerTentacle"])  # it comes back first
def test_attacks_take_what_the_tables_say_until_the_target_is_dead(make_field: Callable[..., Any], case: Case) -> None:
    duel = Duel(make_field, case)
    world, unit = duel.world, duel.target_type
    world.life[duel.target], world.shields[duel.target] = LIFE, SHIELDS
    shields, life = SHIELDS, LIFE
    hits = strikes(duel)
    assert hits, "every weapon hurts its target"
    while life > 0.0:
        before = shields, life
        for damage, armored in hits:
            if life > 0.0:
                shields, life = struck(unit, shields, life, damage, armored)
        taken = duel.attack()
        assert taken == pytest.approx((before[0] - shields, before[1] - life), abs=1e-6)
        assert bool(world.alive[duel.target]) == (life > 0.0)
        if not world.alive[duel.attacker]:
            assert duel.weapon.is_kamikaze
            return


@pytest.mark.parametrize(
    "case",
    [p for p in cases() if p.values[0].weapon not in RHYTHM_OF_THEIR_OWN],
)
def test_attacks_follow_each_other_after_the_period_of_the_tables(make_field: Callable[..., Any], case: Case) -> None:
    duel = Duel(make_field, case)
    world, weapon = duel.world, duel.weapon
    world.life[duel.target] = 1e6
    starts, before = [], 0.0
    for loop in duel.field.loops(400):
        if world.cooldown[duel.attacker] > before:
            starts.append(loop)
        if len(starts) > GAPS:
            break
        before = float(world.cooldown[duel.attacker])
    gaps = np.diff(starts)
    low, high = (0.0, 0.0) if weapon.is_beam else weapon.jitter_loops
    assert len(gaps) >= 6
    assert gaps.min() >= math.floor(weapon.period_loops + low)
    assert gaps.max() <= math.ceil(weapon.period_loops + high)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_damage_that_the_api_tells_is_what_one_attack_deals(version: str) -> None:
    """The API's own table (damage and attacks of a weapon) against the sum of the hits, before armor and bonus."""
    for weapon in load_catalog(version).weapons:
        if weapon.id in API_TELLS_OTHERWISE or not weapon.hits or not weapon.shown_damage:
            continue
        on_it = [h for h in weapon.hits if on_target(h) and h.when in ("", "else", "TargetRadiusSmall")]
        assert sum(h.damage for h in on_it) == weapon.shown_damage * weapon.shown_attacks, weapon.id


API_TELLS_OTHERWISE = {
    "MothershipBeam",  # one of its six rays
    "BattlecruiserWeaponSwitch",  # what it does to ground units
}
