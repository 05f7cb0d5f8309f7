"""Every text action of LLM-PySC2 is there, with its arguments, unit types and function.

`golden/paper_actions.tsv` holds 161 names, 147 of the paper's tables B1 to B10 and 14 of its code alone: name,
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


OF_THE_CODE = {
    "Ability_ChronoBoost_Unit", "Ability_MothershipMassRecall_Near", "Ability_NexusMassRecall_Near",
    "Ability_PrismaticAlignment", "Ability_PurificationNova_Screen", "Auto_Morph_Warpgate", "ChronoBoost_Economy",
    "ChronoBoost_Military", "ChronoBoost_Research", "Continuously_Monitor_Here", "Stop", "Stop_Building",
    "Stop_Building_Unit", "Wait_For_Unit_Warp",
}  # fmt: skip


def test_the_paper_has_147_names_and_its_code_14_more() -> None:
    names = {row.name for row in ROWS}
    assert len(names) == len(ROWS) == 161
    assert names >= OF_THE_CODE
    assert len(names - OF_THE_CODE) == 147


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
