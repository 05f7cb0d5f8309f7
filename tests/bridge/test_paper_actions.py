"""Every text action of the paper is there, with its arguments, unit types and function.

`golden/paper_actions.tsv` holds the 161 names of the paper's tables B1 to B10 and of its first implementation: name,
arguments, function, unit types, other spellings; bridge/khala_bridge/data/SOURCES.md lists the corrected slips of the
tables.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pytest

from khala_bridge.catalogue.catalogue import alias_of
from khala_bridge.catalogue.functions import functions

if TYPE_CHECKING:
    from khala_bridge.catalogue.catalogue import Action


class Row(NamedTuple):
    name: str
    args: tuple[str, ...]
    function: str
    units: frozenset[str]
    aliases: tuple[str, ...]


def _row(line: str) -> Row:
    name, args, function, units, aliases = line.split("\t")
    return Row(name, tuple(args.split()), function, frozenset(units.split()), tuple(aliases.split()))


ROWS = [_row(line) for line in (Path(__file__).parent / "golden/paper_actions.tsv").read_text().splitlines()]
OTHERWISE = {
    "Stop_Building": "Cancel_Last_quick",  # the paper's function is of a structure that nobody can have
    "Stop_Building_Unit": "Cancel_Last_quick",
    "All_Units_Defend": "Attack_minimap",  # the paper's walks without fighting
    "All_Units_Retreat": "Move_minimap",
    "ChronoBoost_Economy": "Effect_ChronoBoostEnergyCost_screen",  # the paper's host did it outside of the catalogue
    "ChronoBoost_Military": "Effect_ChronoBoostEnergyCost_screen",
    "ChronoBoost_Research": "Effect_ChronoBoostEnergyCost_screen",
    "Worker_Scan": "Move_minimap",
}


def found(name: str) -> Action:
    action = alias_of(name)
    assert action is not None
    return action


def test_the_paper_has_161_names() -> None:
    assert len({row.name for row in ROWS}) == len(ROWS) == 161


def test_an_action_of_the_paper_takes_what_it_takes_there(subtests: pytest.Subtests) -> None:
    for row in ROWS:
        with subtests.test(row.name):
            assert found(row.name).args == row.args


def test_an_action_of_the_paper_ends_in_its_function(subtests: pytest.Subtests) -> None:
    for row in ROWS:
        with subtests.test(row.name):
            wanted = OTHERWISE.get(row.name, row.function)
            assert found(row.name).function == (None if wanted == "no_op" else wanted)
            assert wanted in functions()


def test_every_unit_type_of_the_paper_has_the_action(subtests: pytest.Subtests) -> None:
    for row in ROWS:
        with subtests.test(row.name):
            assert [unit for unit in row.units if not found(row.name).fits(unit)] == []


def test_other_spellings_mean_the_same(subtests: pytest.Subtests) -> None:
    for row in ROWS:
        with subtests.test(row.name):
            assert {found(alias) for alias in row.aliases} <= {found(row.name)}


@pytest.mark.parametrize(
    ("spelling", "name"),
    [
        ("Pheonix_Scan", "Phoenix_Scan"),
        ("Select_Two_Unit_Morph_Archon", "Select_Two_Units_Morph_Archon"),
        ("effect_psistorm_screen", "Ability_PsiStorm_Screen"),
        ("EFFECT_FORCEFIELD_SCREEN", "Ability_ForceField_Screen"),
        ("attack_unit", "Attack_Unit"),
    ],
)
def test_an_action_is_known_by_its_other_names_in_any_case(spelling: str, name: str) -> None:
    assert found(spelling).name == name
