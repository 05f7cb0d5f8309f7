"""Every one of PySC2's functions is reached in words, or it is said why not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.catalogue.coverage import coverage
from khala_bridge.catalogue.functions import functions
from khala_bridge.catalogue.generated import without_words
from khala_bridge.compat import actions as pysc2
from khala_bridge.knowledge import abilities

if TYPE_CHECKING:
    from khala_bridge.catalogue.catalogue import Action

ORDERS = [action for action in catalogue().values() if action.function]
CHILDREN_OF_CASTERS = {"InfestedTerran", "InfestedTerranBurrowed"}
"""Types that nobody trains or builds, so that `melee` does not tell whether a player can have them."""


def in_pysc2(name: str | None) -> Any:
    return pysc2.FUNCTIONS[name]


def raw_kinds(ability: int) -> set[str]:
    """Return the kinds of PySC2's raw functions of an ability: `pt`, `unit`, `quick`, `autocast`."""
    kinds = {each.function_type.__name__ for each in pysc2.RAW_FUNCTIONS if each.ability_id == ability}
    return {kind.removeprefix("raw_").removeprefix("cmd_").replace("cmd", "quick") for kind in kinds}


def test_every_function_stands_in_the_table_once_in_the_order_of_the_ids() -> None:
    assert [row.function.id for row in coverage()] == list(range(573)) == [int(each.id) for each in pysc2.FUNCTIONS]


def test_a_function_is_reached_or_it_is_said_why_not() -> None:
    assert [row.function.name for row in coverage() if bool(row.actions) == bool(row.reason)] == []


def test_how_many_functions_are_reached() -> None:
    reached = [row for row in coverage() if row.actions]
    interface = [row for row in coverage() if row.function.kind == "interface"]
    assert (len(reached), len(interface), len(coverage()) - len(reached) - len(interface)) == (534, 12, 27)


def test_only_functions_of_the_interface_and_of_what_the_version_lacks_are_left_out() -> None:
    usable = {
        name
        for name, function in functions().items()
        if function.ability_id
        and (
            abilities()[function.ability_id].melee or set(abilities()[function.ability_id].users) & CHILDREN_OF_CASTERS
        )
    }
    assert set(without_words()) == set(functions()) - usable


def test_a_reason_is_a_sentence() -> None:
    assert [name for name, reason in without_words().items() if not reason.endswith(".") or len(reason) < 20] == []


def test_an_action_names_functions_as_pysc2_does() -> None:
    told = {a.name: (a.function, a.pysc2.id, a.pysc2.ability_id) for a in ORDERS if a.pysc2}
    there = {a.name: in_pysc2(a.function) for a in ORDERS}
    assert told == {name: (each.name, each.id, each.ability_id) for name, each in there.items()}


def test_an_action_gives_what_its_function_takes_or_leaves_it_to_a_rule() -> None:
    def given(action: Action) -> list[str]:
        place = "screen" if action.target_kind == "tag" else action.target_kind
        return [] if place is None else [place]

    def taken(action: Action) -> list[str]:
        return [argument.name for argument in in_pysc2(action.function).args if argument.name != "queued"]

    assert [a.name for a in ORDERS if not a.rule and given(a) != taken(a)] == []


def test_an_action_aims_as_the_raw_interface_can() -> None:
    def aimed(action: Action) -> str:
        if action.target_kind is None:
            return "autocast" if in_pysc2(action.function).function_type is pysc2.autocast else "quick"
        return "unit" if action.target_kind == "tag" and action.aim == "unit" else "pt"

    raw = {ability: raw_kinds(ability) for ability in {a.pysc2.ability_id for a in ORDERS if a.pysc2}}
    assert [a.name for a in ORDERS if a.pysc2 and not a.rule and aimed(a) not in raw[a.pysc2.ability_id]] == []


def test_only_actions_whose_function_can_wait_wait() -> None:
    assert [a.name for a in ORDERS if a.queue and "queued" not in functions()[a.function or ""].args] == []


@pytest.mark.parametrize(
    "name",
    [
        "Effect_Stim", "Morph_SiegeMode", "Build_SpawningPool_Screen", "Train_Marine", "Build_Barracks",
        "Build_SpawningPool", "Effect_Heal_Autocast", "Rally_Units_Minimap", "Effect_Blink_Stalker_Screen",
        "Stop_Battlecruiser", "Smart_Unit", "Select_Unit_Effect_Stim", "Select_Unit_Train_Marine",
        "Select_Unit_Build_Barracks_Screen", "Hallucination_Phoenix", "Research_ZergMeleeWeaponsLevel2",
        "Train_Ravager", "Morph_Ravager", "Morph_Lair", "Cancel_Queue5", "UnloadAll_Bunker",
    ],
)  # fmt: skip
def test_a_function_of_any_race_has_the_name_that_one_would_guess(name: str) -> None:
    assert name in catalogue()


def test_general_and_special_functions_are_both_reached() -> None:
    both = [row for row in coverage() if row.function.general_id and not row.reason]
    reached = {row.function.ability_id for row in coverage() if row.actions}
    assert [row.function.name for row in both if row.function.general_id not in reached] == []


def test_whatever_a_team_can_be_told_can_be_told_to_one_unit() -> None:
    single = {(a.function, a.target_kind, a.aim) for a in catalogue().values() if a.subject == "unit"}
    assert [a.name for a in ORDERS if a.subject == "team" and (a.function, a.target_kind, a.aim) not in single] == []


def test_names_are_unique_in_any_case_of_letters() -> None:
    names = [name.casefold() for action in catalogue().values() for name in (action.name, *action.aliases)]
    assert len(names) == len(set(names))


def test_what_follows_by_rule_stands_for_what_is_not_written() -> None:
    made = [action for action in catalogue().values() if action.group == "generated" and action.subject == "team"]
    written = {
        (a.function, a.target_kind) for a in catalogue().values() if a.group != "generated" and a.subject == "team"
    }
    assert [action.name for action in made if (action.function, action.target_kind) in written] == []
