"""Every text action, said as a model would say it and played through the raw interface, changes the game."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.catalogue.functions import functions
from khala_bridge.catalogue.generated import without_words

from .cases import by_caster, cases
from .performance import perform
from .without_effect import BY_RAW, SINGLE, reason

if TYPE_CHECKING:
    from collections.abc import Callable

    from .cases import Case
    from .stage import Stage

    Stages = Callable[..., Stage]


def kind(name: str) -> object:
    """Return the kind of an action: one of each function, subject and target, with and without rule, stands for all.

    What each rule does is in `tests/bridge/auto`.
    """
    action = cases()[name].action
    return action.pysc2.kind if action.pysc2 else None, action.subject, action.rule is None, action.target_kind


def stands_for_others(name: str) -> bool:
    """Return False for the generated actions for one unit of a team, which stand for no others."""
    return not (name.startswith(SINGLE) and cases()[name].action.group == "generated")


@pytest.mark.parametrize("group", by_caster(stands_for_others, kind))
def test_a_text_action_does_what_it_says(group: list[Case], stage_of: Stages, subtests: pytest.Subtests) -> None:
    for case in group:
        with subtests.test(case.action.name):
            does_what_it_says(case, stage_of)


def does_what_it_says(case: Case, stage_of: Stages) -> None:
    action = case.action
    performance = perform(case, stage_of(case), RawExecutor())
    if action.function is None:
        assert performance.accepted
        assert performance.words == frozenset()
    elif why := reason(action.name, BY_RAW):
        assert performance.words == frozenset(), f"it has an effect, though {why}: it has to leave the table"
    else:
        assert performance.words, f"{performance.text} had no effect; refused: {performance.refusals[:3]}"


def test_the_table_of_those_without_effect_names_actions() -> None:
    assert BY_RAW.keys() <= catalogue().keys()


def test_every_function_has_an_action_whose_effect_is_seen() -> None:
    seen = {action.function for name, action in catalogue().items() if reason(name, BY_RAW) is None}
    unseen = functions().keys() - seen - without_words().keys()
    paint = {name for name in functions() if name.startswith("Effect_Spray")}
    assert unseen == paint | {"Rally_Morphing_Unit_screen", "Rally_Morphing_Unit_minimap"}
