"""Reading checks the catalogue; errors say what is wrong with an action, and where."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from khala_bridge import auto
from khala_bridge.catalogue.action import Action
from khala_bridge.catalogue.catalogue import GROUPS, catalogue, catalogue_sha256, chosen, example, read, read_curated
from khala_bridge.errors import CatalogueError
from khala_bridge.knowledge import abilities, facts_of, knowledge

if TYPE_CHECKING:
    from pathlib import Path

FAULTS = [
    ("{about: x, function: Move_scren, args: [screen]}", "PySC2 has no function Move_scren, did you mean Move_screen?"),
    ("{about: x, function: Move_screen}", "Move_screen takes a target, and it has none"),
    ("{about: x, function: Stop_quick, args: [screen]}", "Stop_quick takes no screen"),
    ("{about: x, function: Move_minimap, args: [screen]}", "Move_minimap takes no screen"),
    ("{about: x, function: Move_screen, args: [screen, tag]}", "it has more than one target: ['screen', 'tag']"),
    ("{about: x, function: Effect_PsiStorm_screen, args: [tag]}", "PySC2's raw interface has no Effect_PsiStorm_unit"),
    ("{about: x, function: Effect_Feedback_screen, args: [screen]}", "PySC2's raw interface has no Effect_Feedback_pt"),
    (
        "{about: x, function: Stop_quick, subject: unit}",
        "its first 1 argument(s) name units, so they are tags, not []",
    ),
    (
        "{about: x, function: Morph_Archon_quick, subject: two_units, args: [tag, screen]}",
        "its first 2 argument(s) name units, so they are tags, not ['tag', 'screen']",
    ),
    (
        "{about: x, function: Train_Zealot_quick, subject: side}",
        "an action of the whole side needs a rule that says who carries it out",
    ),
    ("{about: x, function: Stop_quick, target: enemy}", "only a tag can be enemy, and it has none for its target"),
    ("{about: x, function: Stop_quick, units: [Stlaker]}", "there is no unit type Stlaker, did you mean Stalker?"),
    ("{about: x, function: Stop_quick, produces: Zealto}", "there is no unit type or upgrade Zealto to produce"),
    ("{about: x, args: [screen]}", "it orders nothing, and has arguments: ['screen']"),
    ("{about: x, args: [scren]}", "args.0: Input should be 'tag', 'screen' or 'minimap'"),
    ("{about: x, functon: Stop_quick}", "functon: Extra inputs are not permitted"),
    ("{function: Stop_quick}", "about: Field required"),
    ("{about: x, aliases: [halt]}", "the name halt is already that of Halt"),
]


def page(folder: Path, text: str, name: str = "all_test.yaml") -> Path:
    file = folder / name
    file.write_text(f"# words\n\ncommon: {{group: test}}\n\nactions:\n{text}", encoding="utf-8")
    return file


@pytest.mark.parametrize(("entry", "fault"), FAULTS, ids=[fault for _, fault in FAULTS])
def test_a_fault_is_told_with_its_file_and_line(tmp_path: Path, entry: str, fault: str) -> None:
    file = page(tmp_path, f"  Halt:\n    about: Stand.\n  Fault: {entry}\n")
    with pytest.raises(CatalogueError) as told:
        read(file)
    assert str(told.value) == f"all_test.yaml:8: text action Fault: {fault}"


def test_a_name_that_stands_twice_in_a_file_is_told(tmp_path: Path) -> None:
    file = page(tmp_path, "  Halt: {about: a}\n  Go: {about: b}\n  Halt: {about: c}\n")
    with pytest.raises(CatalogueError, match=r"all_test.yaml:8: text action Halt: it stands in line 6 as well"):
        read(file)


def test_a_name_that_another_file_has_in_another_case_is_told(tmp_path: Path) -> None:
    first, second = (
        page(tmp_path, "  Halt: {about: a}\n", "a.yaml"),
        page(tmp_path, "  HALT: {about: a}\n", "b.yaml"),
    )
    with pytest.raises(CatalogueError, match=r"b.yaml:6: text action HALT: the name HALT is already that of Halt"):
        read(first, second)


def test_actions_have_what_is_common_to_their_file_and_what_is_their_own(tmp_path: Path) -> None:
    found = read(page(tmp_path, "  Halt: {about: a}\n  Go: {about: b, group: other}\n"))
    assert found == {
        "Halt": Action(name="Halt", about="a", group="test"),
        "Go": Action(name="Go", about="b", group="other"),
    }


def test_every_rule_that_an_action_names_is_there() -> None:
    assert {action.rule for action in catalogue().values() if action.rule} <= set(auto.RULES)


def test_what_is_written_of_an_action_can_be_shown_to_a_model(subtests: pytest.Subtests) -> None:
    for action in read_curated().values():
        with subtests.test(action.name):
            assert action.about[0].isupper()
            assert action.about.endswith(".")
            assert len(action.about) <= 200
            assert "{" not in action.about


def test_an_action_of_one_race_is_for_units_of_that_race() -> None:
    races = {name: kind.race for name, kind in knowledge().items()}
    wrong = [a.name for a in catalogue().values() if a.race and {races[unit] for unit in a.units} != {a.race}]
    assert wrong == []


def test_an_action_without_a_race_is_for_units_of_several() -> None:
    races = {name: kind.race for name, kind in knowledge().items()}
    wrong = [a.name for a in catalogue().values() if a.race is None and len({races[unit] for unit in a.units}) == 1]
    assert wrong == []


@pytest.mark.parametrize(
    ("race", "basics"),
    [
        ("protoss", {"Train_Probe", "Build_Pylon", "Build_Gateway", "Train_Zealot", "Build_Nexus"}),
        ("terran", {"Train_SCV", "Build_SupplyDepot", "Build_Barracks", "Train_Marine", "Scan_Minimap"}),
        ("zerg", {"Train_Drone", "Build_SpawningPool", "Train_Zergling", "Inject_Larva"}),
    ],
)  # fmt: skip
def test_a_developer_of_any_race_can_do_its_work_with_groups(race: str, basics: set[str]) -> None:
    groups = [f"group:{group}/{race}" for group in ("easy-build", "train", "research", "macro", "easy-control")]
    found = set(chosen(groups))
    assert basics | {"All_Units_Attack", "Worker_Scan"} <= found
    assert {catalogue()[name].race for name in found} == {race, None}
    assert {catalogue()[name].subject for name in found} == {"side"}


def test_a_structure_can_be_built_at_a_point_near_something_and_anywhere() -> None:
    made = {a.produces for a in catalogue().values() if a.rule == "build_auto"}
    names = {name for kind in made for name in (f"Build_{kind}", f"Build_{kind}_Near", f"Build_{kind}_Screen")}
    assert names <= set(catalogue())
    structures = {name for name, kind in knowledge().items() if kind.structure and kind.melee}
    assert made <= structures


def test_every_action_is_of_a_group_that_is_told_of() -> None:
    assert {action.group for action in catalogue().values()} == set(GROUPS)


def test_a_group_of_a_type_holds_what_its_units_have() -> None:
    assert chosen(["group:skill"], "Stalker") == ("Ability_Blink_Screen", "Select_Unit_Blink_Screen")


@pytest.mark.parametrize(
    ("selector", "fault"),
    [
        ("group:skil", "there is no group of actions 'skil' (did you mean 'skill'?)"),
        ("group:warp/zerg", "there is no group of actions 'warp/zerg'"),
        ("group:train", "group 'train' has actions of protoss, terran, zerg: write group:train/protoss"),
    ],
)
def test_a_group_that_cannot_be_meant_is_told(selector: str, fault: str) -> None:
    with pytest.raises(ValueError, match="group") as told:
        chosen([selector])
    assert str(told.value).startswith(fault)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("Stop", "<Stop()>"),
        ("Move_Screen", "<Move_Screen([15, 9])>"),
        ("Move_Minimap", "<Move_Minimap([40, 25])>"),
        ("Select_Unit_Attack_Unit", "<Select_Unit_Attack_Unit(0x1002c0001, 0x100340002)>"),
    ],
)
def test_an_example_is_a_call_as_an_agent_writes_it(name: str, call: str) -> None:
    assert example(catalogue()[name]) == call


def test_an_agent_is_told_of_an_action_what_it_is() -> None:
    told = {name: (action.spec.name, action.spec.args, action.spec.description) for name, action in catalogue().items()}
    assert told == {name: (name, action.args, action.about) for name, action in catalogue().items()}


def test_the_hash_changes_with_nothing_but_the_catalogue() -> None:
    assert catalogue_sha256() == catalogue_sha256()
    assert len(catalogue_sha256()) == 64


def test_the_catalogue_needs_no_pysc2() -> None:
    script = "import sys, khala_bridge.catalogue.catalogue as c; c.catalogue(); sys.exit('pysc2' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


WIDER = {
    "Morph_ObserverMode": {"Observer"},  # as in the paper: a unit is listed in both of its forms
    "Morph_WarpPrismTransportMode": {"WarpPrism"},
    "BurrowDown": {"InfestedTerran"},  # made by a spell, not by a player's orders
    "BurrowUp": {"InfestedTerranBurrowed"},
}


def test_the_units_of_a_written_action_are_those_that_the_game_lets_do_it() -> None:
    found: dict[str, set[str]] = {}
    for name, action in read_curated().items():
        if action.pysc2 and action.units:
            users = abilities()[action.pysc2.ability_id].users
            found |= {name: extra} if (extra := {unit for unit in action.units if unit not in users}) else {}
    assert found == {name: types for name, types in WIDER.items() if name in found}


def test_what_a_written_action_produces_is_what_the_game_makes_of_it() -> None:
    def made(action: Action) -> str | None:
        facts = abilities()[action.pysc2.ability_id] if action.pysc2 else None
        return (facts.produces or facts.researches) if facts else None

    wrong = [
        name
        for name, action in read_curated().items()
        if action.produces and made(action) not in (None, action.produces)
    ]
    assert wrong == []


def test_how_far_a_jump_reaches_is_what_the_game_says() -> None:
    jump = read_curated()["Ability_Blink_Screen"]
    facts = facts_of("multi").ability_of(jump.pysc2.ability_id, "Stalker") if jump.pysc2 else None
    assert facts
    assert f"at most {facts.figures['distance']:g} away" in jump.about
