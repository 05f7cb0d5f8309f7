"""The data files fit PySC2 and each other."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from khala_bridge import data
from khala_bridge.catalogue.catalogue import catalogue, catalogue_sha256
from khala_bridge.catalogue.functions import check_against_pysc2
from khala_bridge.compat import upgrades
from khala_bridge.knowledge import knowledge
from khala_bridge.names import unit_name
from khala_bridge.task.maps import known_maps
from khala_bridge.task.standard import standard_task

if TYPE_CHECKING:
    import pytest


def test_the_table_of_functions_is_that_of_pysc2() -> None:
    check_against_pysc2()


def test_an_action_speaks_of_things_that_exist(subtests: pytest.Subtests) -> None:
    for name, action in catalogue().items():
        with subtests.test(name):
            assert action.name == name
            assert set(action.units) <= set(knowledge())
            assert action.about.endswith(".")


def test_the_hash_of_the_catalogue_is_a_sha256() -> None:
    assert len(catalogue_sha256()) == 64


def test_the_maps_of_every_family_are_known() -> None:
    families = Counter(spec.file.partition("/")[0] for spec in known_maps().values())
    assert families == {"llm_smac": 9, "llm_pysc2": 25, "SMAC_Maps": 23, "mini_games": 7, "Melee": 8, "duels": 3}
    names = [(name.removeprefix("smac_"), spec.file) for name, spec in known_maps().items()]
    assert all(file.endswith(f"/{name}.SC2Map") for name, file in names)


def test_a_task_can_be_made_for_every_map(subtests: pytest.Subtests) -> None:
    for name, spec in known_maps().items():
        with subtests.test(name):
            task = standard_task(spec)
            (agent,) = task.agents
            assert (task.name, task.map, task.task) == (name, name, spec.goal)
            assert [team.unit_types for team in agent.teams if team.kind != "side"] == [(unit,) for unit in spec.units]
            builds = any(knowledge()[unit].worker for unit in spec.units)
            assert [team.name for team in agent.teams if team.kind == "side"] == (["Base"] if builds else [])
            assert all("Move_Screen" in listed for listed in agent.actions.values())
            assert all(upgrade in upgrades.Upgrades.__members__ for upgrade in spec.upgrades)
            blinks = "Ability_Blink_Screen" in agent.actions.get("Stalker", ())
            researches = any(knowledge()[unit].worker for unit in spec.units)
            assert blinks == ("Stalker" in spec.units and (researches or "Blink" in spec.upgrades))


def test_copies_on_smacs_maps_have_the_names_of_what_they_copy() -> None:
    assert [unit_name(number) for number in (1961, 1962, 1963, 1966, 1970, 1971)] == [
        "MineralField450", "Colossus", "Stalker", "Marine", "Hydralisk", "Unit1971",
    ]  # fmt: skip


def test_the_sources_of_every_data_file_are_told() -> None:
    sources = data.path("SOURCES.md").read_text(encoding="utf-8")
    told = {word.strip("`,") for word in sources.split()}
    files = [path for path in Path(data.path(".")).rglob("*") if path.suffix in {".yaml", ".tsv"}]
    assert [p for p in files if p.name not in told and f"{p.relative_to(data.path('.')).parts[0]}/" not in told] == []
