"""Stages that tests share: setting one up takes longer than playing on it."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import pytest

from .stage import Stage

if TYPE_CHECKING:
    from collections.abc import Callable

    from .cases import Case

KEPT = 8
"""Number of stages in the cache; the cases are in the order of their stages."""


@pytest.fixture(scope="session")
def stage_of() -> Callable[..., Stage]:
    """Return the stage of a case, with a screen or without."""

    @functools.lru_cache(KEPT)
    def kept(*of: object, layers: bool) -> Stage:
        return Stage(*of, layers=layers)  # type: ignore[arg-type]  # the fields of a case, in their order

    def stage(case: Case, *, layers: bool = False) -> Stage:
        return kept(*case.stage, layers=layers)

    return stage
