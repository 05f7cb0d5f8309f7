"""The data files fit PySC2 and each other."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from bridge import data
from bridge.catalog import catalogue, catalogue_sha256
from bridge.compat import units, upgrades
from bridge.functions import check_against_pysc2
from bridge.knowledge import RACES, is_armed, knowledge
from bridge.maps import known_maps
from bridge.names import unit_name
from bridge.standard import standard_task

NUMBERS = {member.name: int(member) for race in (units.Protoss, units.Terran, units.Zerg) for member in race}


def test_the_table_of_functions_is_that_of_pysc2() -> None:
    check_against_pysc2()


@pytest.mark.parametrize("name", list(catalogue()))
def test_an_action_speaks_of_things_that_exist(name: str) -> None:
    action = catalogue()[name]
    assert action.name == name
    assert set(action.units) <= set(knowledge())
    assert action.needs.upgrade is None or action.needs.upgrade in upgrades.Upgrades.__members__
    assert action.about.endswith(".")


def test_the_hash_of_the_catalogue_is_a_sha256() -> None:
    assert len(catalogue_sha256()) == 64


def test_every_known_type_has_the_name_and_number_of_pysc2() -> None:
    assert {name: kind.id for name, kind in knowledge().items()} == {name: NUMBERS[name] for name in knowledge()}


def test_what_is_known_is_complete_enough_to_speak_of() -> None:
    for name, kind in knowledge().items():
        assert kind.about.endswith("."), name
        assert kind.health > 0, name
        assert all(weapon.period_s > 0 and weapon.damage > 0 for weapon in kind.weapons), name


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
    assert not is_armed("Observer")
    assert is_armed("Zealot")
    assert is_armed("Something of a later version")


def test_damage_per_second_counts_hits_and_period() -> None:
    (blades,) = knowledge()["Zealot"].weapons
    assert blades.per_second == pytest.approx(8 * 2 / 0.86)


def test_the_maps_of_every_family_are_known() -> None:
    families = Counter(spec.file.partition("/")[0] for spec in known_maps().values())
    assert families == {"llm_smac": 9, "llm_pysc2": 25, "SMAC_Maps": 23, "mini_games": 7, "Melee": 8}
    names = [(name.removeprefix("smac_"), spec.file) for name, spec in known_maps().items()]
    assert all(file.endswith(f"/{name}.SC2Map") for name, file in names)


@pytest.mark.parametrize("name", list(known_maps()))
def test_a_task_can_be_made_for_every_map(name: str) -> None:
    spec = known_maps()[name]
    task = standard_task(spec)
    (agent,) = task.agents
    assert (task.name, task.map, task.task) == (name, name, spec.goal)
    assert [team.unit_types for team in agent.teams] == [(unit,) for unit in spec.units]
    assert all("Move_Screen" in listed for listed in agent.actions.values())
    assert all(upgrade in upgrades.Upgrades.__members__ for upgrade in spec.upgrades)
    blinks = "Ability_Blink_Screen" in agent.actions.get("Stalker", ())
    assert blinks == ("Blink" in spec.upgrades and "Stalker" in spec.units)


def test_copies_on_smacs_maps_have_the_names_of_what_they_copy() -> None:
    assert [unit_name(number) for number in (1961, 1962, 1963, 1966, 1970, 1971)] == [
        "MineralField450", "Colossus", "Stalker", "Marine", "Hydralisk", "Unit1971",
    ]  # fmt: skip


def test_the_sources_of_every_data_file_are_told() -> None:
    sources = data.path("SOURCES.md").read_text(encoding="utf-8")
    told = {word.strip("`") for word in sources.split()}
    files = [path for path in Path(data.path(".")).rglob("*") if path.suffix in {".yaml", ".tsv"}]
    assert [p for p in files if p.name not in told and f"{p.relative_to(data.path('.')).parts[0]}/" not in told] == []
    assert {path.stem for path in data.path("knowledge").iterdir()} == set(RACES)
