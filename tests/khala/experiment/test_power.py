"""How many games are needed: figures of other libraries, and simulated power."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats as scipy_stats  # type: ignore[import-untyped]
from statsmodels.stats.proportion import power_proportions_2indep  # type: ignore[import-untyped]

from khala_sc2.experiment.power import (
    games_for_half_width,
    games_for_power,
    games_to_separate,
    mcnemar_power,
    pairs_for_power,
)
from khala_sc2.experiment.statistics import wilson_bounds


def test_93_games_separate_50_from_70_percent_by_every_rule() -> None:
    assert games_to_separate(0.5, 0.7) == games_to_separate(0.7, 0.5) == 93
    assert games_for_power(0.5, 0.7) == 93
    assert games_for_half_width(0.1) == 93


@given(st.floats(0.005, 0.4), st.floats(0, 1))
def test_one_game_less_makes_a_wider_interval(half_width: float, share: float) -> None:
    games = games_for_half_width(half_width, share=share)
    low, high = wilson_bounds(share, games)
    assert (high - low) / 2 <= half_width
    if games > 1:
        low, high = wilson_bounds(share, games - 1)
        assert (high - low) / 2 > half_width


@given(st.integers(1, 9), st.integers(1, 9).filter(bool))
def test_games_for_a_power_are_those_of_statsmodels(a: int, b: int) -> None:
    if a == b:
        return
    games = games_for_power(a / 10, b / 10)
    power = power_proportions_2indep(abs(a - b) / 10, min(a, b) / 10, games, return_results=False)
    less = power_proportions_2indep(abs(a - b) / 10, min(a, b) / 10, games - 1, return_results=False)
    assert less < 0.8 <= power + 1e-9


def test_pairs_for_a_power_have_it_in_simulation() -> None:
    pairs = pairs_for_power(0.35, 0.15)
    draws = np.random.default_rng(1).multinomial(pairs, [0.35, 0.15, 0.5], size=4000)
    p = scipy_stats.binom.cdf(draws[:, :2].min(axis=1), draws[:, :2].sum(axis=1), 0.5) * 2
    assert (p <= 0.05).mean() == pytest.approx(0.8, abs=0.02)
    assert mcnemar_power(pairs - 1, 0.35, 0.15) < 0.8 <= mcnemar_power(pairs, 0.35, 0.15)


@pytest.mark.parametrize("shares", [(0.5, 0.5), (-0.1, 0.5), (0.5, 1.1)])
def test_shares_that_no_games_separate_are_refused(shares: tuple[float, float]) -> None:
    for needed in (games_to_separate, games_for_power, pairs_for_power):
        with pytest.raises(ValueError, match="it takes two different shares from 0 to 1"):
            needed(*shares)


def test_an_interval_without_width_is_refused() -> None:
    with pytest.raises(ValueError, match="it must be above 0"):
        games_for_half_width(0)
