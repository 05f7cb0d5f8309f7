"""The same words played through the raw interface and through camera, selection and screen end in the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bridge.act.raw import RawExecutor
from bridge.act.screen import ScreenExecutor
from bridge.catalog import catalogue

from .cases import Case, cases
from .effect import kinds
from .performance import perform
from .without_effect import BY_RAW, BY_SCREEN, reason

if TYPE_CHECKING:
    from collections.abc import Callable

    from .stage import Stage

    Stages = Callable[..., Stage]


def every_case() -> list[object]:
    """One of each kind of function and of subject, with a rule and without, at once; all others in the long tests."""
    shown: set[object] = set()
    made: list[object] = []
    for name, case in cases().items():
        action = case.action
        kind = (action.pysc2.kind if action.pysc2 else None, action.subject, action.rule is None, action.target_kind)
        others = kind in shown or bool(reason(name, BY_SCREEN))
        made.append(pytest.param(case, id=name, marks=[pytest.mark.slow] if others else []))
        shown |= set() if others else {kind}
    return made


@pytest.mark.parametrize("case", every_case())
def test_both_executors_do_the_same(case: Case, stage_of: Stages) -> None:
    raw = perform(case, stage_of(case), RawExecutor())
    screen = perform(case, stage_of(case, layers=True), ScreenExecutor(), said=raw.text)
    if why := reason(case.action.name, BY_SCREEN):
        assert screen.words == frozenset(), f"it has an effect, though {why}: it has to leave the table"
    else:
        same, other = kinds(screen.words) & kinds(raw.words), kinds(screen.words) ^ kinds(raw.words)
        assert all(" buff " in word for word in other), f"{screen.text}; refused: {screen.refusals}"
        assert same or not other  # who stands at the edge of an area may be in it or not
        assert bool(screen.words) == bool(raw.words)


def test_the_table_of_those_without_effect_names_actions() -> None:
    assert BY_RAW.keys() <= BY_SCREEN.keys() <= catalogue().keys()
