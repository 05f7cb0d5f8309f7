"""The same words played through the raw interface and through camera, selection and screen end in the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.act.screen_executor import ScreenExecutor
from khala_bridge.catalogue.catalogue import catalogue

from .cases import by_caster, cases
from .effect import kinds
from .performance import perform
from .without_effect import BY_RAW, BY_SCREEN, reason

if TYPE_CHECKING:
    from collections.abc import Callable

    from .cases import Case
    from .stage import Stage

    Stages = Callable[..., Stage]


def kind(name: str) -> object:
    """Return the kind of an action: one of each function of PySC2 stands for the others."""
    action = cases()[name].action
    return action.pysc2.kind if action.pysc2 else None


@pytest.mark.parametrize("group", by_caster(lambda name: not reason(name, BY_SCREEN), kind))
def test_both_executors_do_the_same(group: list[Case], stage_of: Stages, subtests: pytest.Subtests) -> None:
    for case in group:
        with subtests.test(case.action.name):
            do_the_same(case, stage_of)


def do_the_same(case: Case, stage_of: Stages) -> None:
    stage = stage_of(case, layers=True)
    raw = perform(case, stage, RawExecutor())
    screen = perform(case, stage, ScreenExecutor(), said=raw.text)
    if why := reason(case.action.name, BY_SCREEN):
        assert screen.words == frozenset(), f"it has an effect, though {why}: it has to leave the table"
    else:
        same, other = kinds(screen.words) & kinds(raw.words), kinds(screen.words) ^ kinds(raw.words)
        assert all(" buff " in word for word in other), f"{screen.text}; refused: {screen.refusals}"
        assert same or not other  # a unit at the edge of an area may be in it or not
        assert bool(screen.words) == bool(raw.words)


def test_the_table_of_those_without_effect_names_actions() -> None:
    assert BY_RAW.keys() <= BY_SCREEN.keys() <= catalogue().keys()
