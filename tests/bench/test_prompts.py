"""Most of a prompt is what the one before it began with, so that a provider's cache has it."""

from __future__ import annotations

from statistics import median

import pytest

from bench.language.prompts import measure


@pytest.mark.game
def test_most_of_a_prompt_is_kept_from_the_one_before() -> None:
    (figures,), _ = measure("3s_vs_3z", [1], 8, "skilled")
    assert len(figures.tokens) == 8
    assert median(figures.kept) > 0.7
    assert max(figures.tokens) < 1500
