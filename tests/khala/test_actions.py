"""`khala actions`: its lists, their order, and its answers to wrong options."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import pytest

from khala_bridge.catalogue.catalogue import catalogue
from khala_sc2.cli import main


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    with pytest.raises(SystemExit) as end:
        main(["actions", *arguments])
    captured = capsys.readouterr()
    return captured.err if end.value.code else captured.out


def names(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    return [action["name"] for action in json.loads(told(capsys, *arguments, "--json"))["actions"]]


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")


def test_without_an_option_the_groups_are_counted(capsys: pytest.CaptureFixture[str]) -> None:
    out = told(capsys)
    assert sum(map(int, re.findall(r"(\d+)  <", out))) == len(catalogue())
    assert f"\n{len(catalogue())} actions; " in out


@pytest.mark.parametrize(
    ("options", "some", "none"),
    [
        ("--unit Stalker", {"Ability_Blink_Screen", "Move_Screen"}, {"Ability_PsiStorm_Screen", "All_Units_Attack"}),
        ("--unit Gateway", {"Train_Zealot", "Select_Unit_Train_Zealot"}, {"Build_Gateway"}),
        ("--race zerg", {"Train_Zergling", "Move_Screen"}, {"Train_Zealot"}),
        ("--group chrono", {"ChronoBoost_Economy", "Ability_ChronoBoost_Unit"}, {"Stop"}),
        ("--name STORM", {"Ability_PsiStorm_Screen", "Research_PsiStorm"}, {"Ability_Blink_Screen"}),
        ("--name pheonix", {"Phoenix_Scan"}, {"Zealot_Scan"}),
        ("--function Effect_Stim_quick", {"Effect_Stim", "Select_Unit_Effect_Stim"}, {"Effect_Stim_Marine"}),
        ("--function 234", {"Effect_Stim"}, {"Effect_Stim_Marine"}),
        ("--race terran --group macro", {"Scan_Minimap", "Harvest_Gather_Unit"}, {"Inject_Larva", "Effect_Stim"}),
    ],
)
def test_options_choose(capsys: pytest.CaptureFixture[str], options: str, some: set[str], none: set[str]) -> None:
    found = set(names(capsys, *options.split()))
    assert some <= found
    assert not none & found


def test_all_lists_all(capsys: pytest.CaptureFixture[str]) -> None:
    assert sorted(names(capsys, "--all")) == sorted(catalogue())


def test_an_action_is_told_with_all_that_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    (found,) = json.loads(told(capsys, "--name", "Select_Two_Units_Morph_Archon", "--json"))["actions"]
    about = found.pop("about")
    assert about.startswith("The team's own two Templar")
    assert found == {
        "name": "Select_Two_Units_Morph_Archon",
        "args": ["tag", "tag"],
        "group": "skill",
        "race": "protoss",
        "aliases": ["Select_Two_Unit_Morph_Archon"],
        "subject": "two_units",
        "units": ["HighTemplar", "DarkTemplar"],
        "function": "Morph_Archon_quick",
        "function_id": 296,
        "aim": "unit",
        "target": None,
        "queue": True,
        "rule": None,
        "produces": None,
        "example": "<Select_Two_Units_Morph_Archon(0x1002c0001, 0x100340002)>",
    }


SHOWN = """
skill, protoss
<Select_Phoenix_Ability_GravitonBeam_Unit(tag, tag)>
    196 Effect_GravitonBeam_screen
    <Select_Phoenix_Ability_GravitonBeam_Unit(0x1002c0001, 0x100340002)>
    Only the team's own Phoenix with the first tag lifts the enemy
    ground unit with the second tag.
    one unit: Phoenix; also Select_Unit_Ability_GravitonBeam_Unit,
    Select_Unit_Ability_GravitonBeam
"""


def test_calls_are_never_broken_however_narrow_the_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "71")
    assert told(capsys, "--name", "Select_Phoenix") == SHOWN


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ("--unit Stlaker", "khala: there is no unit type 'Stlaker', did you mean 'Stalker'?"),
        ("--group skil", "khala: there is no group 'skil', did you mean 'skill'?"),
        ("--function Move_scren", "khala: there is no function of PySC2 'Move_scren', did you mean 'Move_screen'?"),
        ("--function 573", "khala: there is no function of PySC2 '573'"),
    ],
)
def test_what_there_is_not_is_told_in_a_sentence(
    capsys: pytest.CaptureFixture[str], options: str, sentence: str
) -> None:
    assert told(capsys, *options.split()).strip() == sentence


def test_why_a_function_has_no_action_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert told(capsys, "--function", "move_camera").startswith(
        "no action ends in move_camera: The screen executor moves the camera"
    )


def test_it_needs_no_pysc2() -> None:
    script = (
        "import sys, khala_sc2.cli\n"
        "try: khala_sc2.cli.main(['actions', '--json', '--unit', 'Stalker'])\n"
        "except SystemExit: sys.exit('pysc2' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False, capture_output=True).returncode == 0
