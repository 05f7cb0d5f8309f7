"""`khala knowledge` as a user meets it."""

from __future__ import annotations

import json
from operator import attrgetter
from typing import TYPE_CHECKING

import pytest

from khala_bridge.knowledge import short, version_of
from khala_bridge.task.maps import known_maps
from khala_sc2.cli import main
from khala_sc2.knowledge import files
from khala_simulator.maps.game_map import load_map

if TYPE_CHECKING:
    from pathlib import Path

    from khala_bridge.task.maps import MapSpec


STALKER = "Made by Gateway and WarpGate in 30 s; needs CyberneticsCore"
NOTHING = "khala: nothing in version 4.10 of the game is called"


def said(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    """Return exit code, output and errors of `khala knowledge`."""
    with pytest.raises(SystemExit) as exit_:
        main(["knowledge", *arguments])
    out, err = capsys.readouterr()
    return int(exit_.value.code or 0), out, err


def test_the_files_of_facts_are_what_would_be_written_now(version: str) -> None:
    assert files.outdated_files(version) == []


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        (
            "stalker",
            ["Stalker (unit, protoss, id 74)", "    Made by Gateway and WarpGate in 30 s; needs CyberneticsCore"],
        ),
        ("Siege Tank", ["SiegeTank (unit, terran, id 33)", "    Worth 150 minerals, 125 vespene, 3 supply"]),
        ("Hive", ["    Counts also as: Hatchery, Lair", "    Stands on 5 x 5 cells"]),
        ("metabolic_boost", ["MetabolicBoost (upgrade, zerg, id 66)", "    Zergling: speed +2.44"]),
        ("Effect_Stim", ["Effect_Stim (general ability 3675)", "    Stands for: 253, 380, 1683, 1684"]),
        ("1442", ["Effect_Blink_Stalker (ability 1442)", "    Target: point, range anywhere", "    A case of: 3687"]),
        ("Blink", ["Blink (upgrade, protoss, id 87)", "    Allows Effect_Blink_Stalker (1442)"]),
    ],
)
def test_show_tells_what_is_known(name: str, lines: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = said(["show", name], capsys)
    assert code == 0
    assert [line for line in lines if line not in out.splitlines()] == []


def test_show_tells_of_the_version_that_was_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    assert "health 30," in said(["show", "Baneling"], capsys)[1]
    assert "damage 16 (+19 against light)" in said(["show", "Baneling", "--version", "5.0.13"], capsys)[1]


def test_show_gives_json(capsys: pytest.CaptureFixture[str]) -> None:
    (stalker,) = json.loads(said(["show", "Stalker", "--json"], capsys)[1])
    assert (stalker["name"], stalker["health"], stalker["made_by"]) == ("Stalker", 80, [917, 1414])


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        (
            "Stalkr",
            "khala: nothing in version 4.10 of the game is called 'Stalkr'; did you mean Stalker or Train_Stalker?",
        ),
        ("", "khala: nothing in version 4.10 of the game is called ''"),
        ("999999", "khala: nothing in version 4.10 of the game is called '999999'"),
    ],
)
def test_an_unknown_name_is_one_sentence(name: str, sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert said(["show", name], capsys) == (1, "", f"{sentence}\n")


def test_write_makes_files_that_are_missing_or_old(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(files, "directory", lambda version: tmp_path / version)
    names = ["4.10/units.json", "4.10/abilities.json", "4.10/upgrades.json", "4.10/buffs.json"]
    names += ["4.10/units.liberty.json", "4.10/units.void.json"]
    place = "bridge/khala_bridge/data/knowledge"
    error = f"khala: out of date in {place}: {', '.join(names)}; `khala knowledge write` makes them\n"
    assert said(["write", "--version", "4.10", "--check"], capsys) == (1, "", error)
    assert said(["write", "--version", "4.10"], capsys)[1] == "".join(f"wrote {tmp_path / name}\n" for name in names)
    assert said(["write", "--version", "4.10", "--check"], capsys) == (0, "", "")


def test_every_record_stands_on_a_line_of_its_own(version: str) -> None:
    for name, text in files.facts(version).items():
        entries = json.loads(text)["entries"]
        lines = [line.rstrip(",") for line in text.splitlines() if line.startswith('"') and ": {" in line]
        assert [json.loads(f"{{{line}}}") for line in lines[1:]] == [{key: entries[key]} for key in entries], name


@pytest.mark.parametrize("spec", known_maps().values(), ids=attrgetter("name"))
def test_the_bridge_knows_the_data_that_each_map_depends_on(spec: MapSpec) -> None:
    assert spec.data == load_map(spec.file.removesuffix(".SC2Map")).scenario.data


def test_numbers_are_those_of_the_data_that_a_map_depends_on() -> None:
    liberty, multi, void = (short("Stalker", version=version_of(name)) for name in ("liberty", "multi", "void"))
    assert "damage 10 (+4 against armored) every 1.03 s" in liberty[2]
    assert "damage 13 (+5 against armored) every 1.34 s" in multi[2]
    assert void == liberty
    assert "health 90, shield 90" in short("Adept", version=version_of("void"))[1]
    assert "+13 against light" in short("Adept", frozenset(), frozenset({"ResonatingGlaives"}), version_of("void"))[2]
