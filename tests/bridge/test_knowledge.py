"""Knowledge of the game: names and numbers are PySC2's, facts those of the game's tables."""

from __future__ import annotations

import pytest

from khala_bridge.catalogue.functions import functions
from khala_bridge.compat import units, upgrades
from khala_bridge.knowledge import abilities, facts_of, knowledge
from khala_bridge.knowledge import upgrades as known_upgrades

RACES = (units.Neutral, units.Protoss, units.Terran, units.Zerg)
NUMBERS = {member.name: int(member) for race in RACES for member in race}


def test_every_unit_type_of_pysc2_is_known_by_its_name_and_number() -> None:
    assert {name: kind.id for name, kind in knowledge().items()} == NUMBERS


def test_every_known_upgrade_has_the_name_and_number_of_pysc2() -> None:
    numbers = {member.name: int(member) for member in upgrades.Upgrades}
    del numbers["EnhancedShockwaves"]  # the game's tables of 4.10 have none any more
    assert {name: upgrade.id for name, upgrade in known_upgrades().items()} == numbers


def test_every_ability_that_pysc2_has_a_function_for_is_known_by_its_name() -> None:
    named = {f.ability_id: f.stem for f in functions().values() if f.ability_id}
    assert {number: abilities()[number].name for number in named} == named


def test_general_abilities_are_those_of_pysc2() -> None:
    general = {(f.ability_id, f.general_id) for f in functions().values() if f.general_id}
    assert {(a, g) for a, g in general if abilities()[a].general != g or a not in abilities()[g].special} == set()


@pytest.mark.parametrize(
    ("ability", "unit_type", "name"),
    [
        (3675, "Marine", "Effect_Stim_Marine"),
        (3675, "Marauder", "Effect_Stim_Marauder"),
        (3687, "Stalker", "Effect_Blink_Stalker"),
        (3674, "Zealot", "Attack_Attack"),
        (1442, "Stalker", "Effect_Blink_Stalker"),
        (1442, "Zealot", None),
        (3687, "Probe", None),
        (999_999, "Probe", None),
    ],
)
def test_a_general_ability_is_for_each_type_the_special_one_that_it_has(
    ability: int, unit_type: str, name: str | None
) -> None:
    found = facts_of("multi").ability_of(ability, unit_type)
    assert (found.name if found else None) == name


@pytest.mark.parametrize(
    ("name", "types"),
    [
        ("Lair", {"Lair", "Hive"}),
        ("Gateway", {"Gateway", "WarpGate"}),
        ("TechLab", {"TechLab", "BarracksTechLab", "FactoryTechLab", "StarportTechLab"}),
        ("Forge", {"Forge"}),
    ],
)
def test_a_requirement_is_met_by_what_counts_as_the_structure(name: str, types: set[str]) -> None:
    assert facts_of("multi").stand_ins(name) == types


@pytest.mark.parametrize(
    ("name", "field", "value"),
    [  # of 4.10, where the paper's own table or other versions differ
        ("Zealot", "shield", 50),
        ("Stalker", "speed", 4.13),
        ("Colossus", "vespene", 200),
        ("Archon", "minerals", 175),  # between its cheapest and its dearest pair of Templar
        ("Marauder", "health", 125),
        ("Zergling", "minerals", 25),
        ("SpineCrawler", "health", 300),
        ("Queen", "minerals", 150),
    ],
)
def test_numbers_are_those_of_4_10(name: str, field: str, value: float) -> None:
    assert getattr(knowledge()[name], field) == value


def test_a_type_without_a_weapon_is_unarmed_and_an_unknown_one_is_not() -> None:
    assert not facts_of("multi").is_armed("Observer")
    assert facts_of("multi").is_armed("Zealot")
    assert facts_of("multi").is_armed("Something of a later version")


def test_damage_per_second_counts_hits_and_period() -> None:
    (blades,) = knowledge()["Zealot"].weapons
    assert blades.per_second == pytest.approx(8 * 2 / 0.86)


def test_damage_per_second_counts_the_bonus_against_an_attribute() -> None:
    (beam,) = knowledge()["Stalker"].weapons
    assert beam.per_second_against("armored") == pytest.approx((13 + 5) / 1.34)
    assert beam.per_second_against("light") == beam.per_second


@pytest.mark.parametrize(
    ("name", "allowed"),
    [
        (
            "CyberneticsCore",
            {"Stalker", "Sentry", "Adept", "TwilightCouncil", "Stargate", "RoboticsFacility", "ShieldBattery"},
        ),
        ("BanelingNest", {"Baneling"}),
        ("GreaterSpire", {"BroodLord"}),
        ("Stalker", set()),
    ],
)
def test_a_structure_allows_what_requires_it(name: str, allowed: set[str]) -> None:
    assert set(knowledge()[name].allows) >= allowed
    types = {other: kind.requires for other, kind in knowledge().items()}
    better = {other: upgrade.requires for other, upgrade in known_upgrades().items()}
    assert all(name in (types | better)[other] for other in knowledge()[name].allows)
