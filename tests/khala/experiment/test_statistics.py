"""Intervals and tests: the same as those of statsmodels and scipy, and right as often as they say."""

from __future__ import annotations

import itertools
import math
from dataclasses import astuple
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats as scipy_stats  # type: ignore[import-untyped]
from statsmodels.stats.contingency_tables import mcnemar  # type: ignore[import-untyped]
from statsmodels.stats.multitest import multipletests  # type: ignore[import-untyped]
from statsmodels.stats.proportion import (  # type: ignore[import-untyped]
    confint_proportions_2indep,
    proportion_confint,
)

from bench.matches.intervals import average_coverage, bootstrap_coverage, difference_coverage, type_one_errors
from khala_sc2.experiment.statistics import (
    Interval,
    common_values,
    compare_paired_ratios,
    compare_paired_values,
    compare_paired_wins,
    compare_values,
    compare_wins,
    difference_of_shares,
    holm,
    mean,
    ratio_of_sums,
    wilson,
)

if TYPE_CHECKING:
    from collections.abc import Callable

COUNTS = st.integers(1, 300).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))
NUMBERS = st.floats(-1e6, 1e6) | st.none() | st.just(math.nan)
AMOUNTS = st.floats(0, 1e5) | st.just(0.0) | st.none()
NAN = math.nan


# the same as other libraries ------------------------------------------------------------------------------------------


@given(COUNTS, st.sampled_from([0.8, 0.95, 0.99]))
def test_the_interval_of_a_share_is_that_of_statsmodels(counts: tuple[int, int], confidence: float) -> None:
    found = wilson(*counts, confidence=confidence)
    assert [found.low, found.high] == pytest.approx(
        proportion_confint(*counts, alpha=1 - confidence, method="wilson"), abs=1e-12
    )


@given(COUNTS, COUNTS)
def test_the_interval_of_a_difference_is_that_of_statsmodels(a: tuple[int, int], b: tuple[int, int]) -> None:
    found = difference_of_shares(wilson(*a), wilson(*b))
    assert [found.low, found.high] == pytest.approx(confint_proportions_2indep(*a, *b, method="newcomb"), abs=1e-9)


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60))
def test_wins_of_pairs_are_compared_as_in_statsmodels(pairs: list[tuple[bool, bool]]) -> None:
    table = [[pairs.count((x, y)) for y in (True, False)] for x in (True, False)]
    found = compare_paired_wins(*zip(*pairs, strict=True))
    assert found.p == pytest.approx(mcnemar(table, exact=True).pvalue)
    assert found.effect.low <= (table[0][1] - table[1][0]) / len(pairs) <= found.effect.high


@given(st.lists(st.floats(0, 1), min_size=1, max_size=30))
def test_many_tests_are_corrected_as_in_statsmodels(p_values: list[float]) -> None:
    assert holm(p_values) == pytest.approx(multipletests(p_values, method="holm")[1])


@settings(max_examples=20)
@given(*(st.integers(1, 20).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))) for _ in range(2)))
def test_wins_without_pairs_are_compared_as_in_scipy(a: tuple[int, int], b: tuple[int, int]) -> None:
    p = scipy_stats.boschloo_exact([[a[0], b[0]], [a[1] - a[0], b[1] - b[0]]]).pvalue
    assert compare_wins(*a, *b).p == pytest.approx(1.0 if math.isnan(p) else min(1.0, p))


def test_wins_of_many_games_are_compared_by_fishers_test() -> None:
    found = compare_wins(500, 1000, 540, 1000)
    assert found.test == "Fisher's exact test"
    assert found.p == pytest.approx(scipy_stats.fisher_exact([[500, 540], [500, 460]]).pvalue)


@settings(max_examples=20)
@given(st.lists(st.integers(-9, 9), min_size=2, max_size=10))
def test_few_pairs_are_permuted_exactly(differences: list[int]) -> None:
    signs = itertools.product([-1, 1], repeat=len(differences))
    sums = [sum(sign * d for sign, d in zip(one, differences, strict=True)) for one in signs]
    extreme = sum(abs(one) >= abs(sum(differences)) for one in sums)
    found = compare_paired_values(differences, [0] * len(differences))
    assert found.p == pytest.approx(extreme / len(sums))


def test_values_without_pairs_are_permuted_exactly_if_they_are_few() -> None:
    assert compare_values([1, 2, 3, 4], [5, 6, 7, 8]).p == pytest.approx(2 / math.comb(8, 4))


def test_a_ratio_that_is_the_same_for_both_has_no_effect_and_a_doubled_one_has() -> None:
    killed, lost = [300.0, 500, 250, 420, 380, 610], [100.0, 220, 150, 180, 160, 300]
    same = compare_paired_ratios(killed, lost, killed, lost)
    double = compare_paired_ratios([2 * k for k in killed], lost, killed, lost)
    assert [same.effect.value, same.p] == pytest.approx([1, 1])
    assert [double.effect.value, double.p] == pytest.approx([2, 2 / 2**6])
    assert double.effect.low > 1.5


# little data ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (wilson(0, 0), (None, 0, 1, 0)),
        (wilson(10, 10), (1, 0.722, 1, 10)),
        (wilson(0, 10), (0, 0, 0.278, 10)),
        (wilson(10, 20), (0.5, 0.299, 0.701, 20)),
        (difference_of_shares(wilson(0, 0), wilson(1, 2)), (None, -1, 1, 0)),
        (mean([]), (None, -math.inf, math.inf, 0)),
        (mean([None, NAN, math.inf, 4]), (4, -math.inf, math.inf, 1)),
        (mean([2, 2, 2]), (2, 2, 2, 3)),
        (ratio_of_sums([], []), (None, 0, math.inf, 0)),
        (ratio_of_sums([100], [50]), (2, 0, math.inf, 1)),
        (ratio_of_sums([100, 200], [0, 0]), (math.inf, 0, math.inf, 2)),
        (ratio_of_sums([0, 0], [0, 0]), (None, 0, math.inf, 2)),
        (ratio_of_sums([0, 0], [10, 0]), (0, 0, math.inf, 2)),
        (ratio_of_sums([2, 4, 6], [1, 2, 3]), (2, 2, 2, 3)),
        (ratio_of_sums([100, 100, None], [0, 50, 1]), (4, 2, math.inf, 2)),
    ],
)
def test_little_data_makes_wide_intervals(found: Interval, expected: tuple[float | None, ...]) -> None:
    assert astuple(found)[:4] == pytest.approx(expected, abs=5e-4)


@pytest.mark.parametrize(
    "p",
    [
        compare_wins(0, 0, 3, 5).p,
        compare_wins(5, 5, 5, 5).p,
        compare_paired_wins([], []).p,
        compare_paired_wins([1, 0, None], [1, 0, 1]).p,
        compare_values([], [1, 2]).p,
        compare_values([1], [2]).p,
        compare_values([1, 1], [1, 1]).p,
        compare_paired_values([], []).p,
        compare_paired_values([1], [2]).p,
        compare_paired_values([1, 2, None], [1, 2, 5]).p,
        compare_paired_ratios([], [], [], []).p,
        compare_paired_ratios([1, 2], [0, 0], [3, 4], [0, 0]).p,
    ],
)
def test_data_that_say_nothing_prove_nothing(p: float) -> None:
    assert p == 1.0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(NUMBERS, NUMBERS), max_size=12))
def test_no_numbers_raise_or_make_nan(rows: list[tuple[float | None, float | None]]) -> None:
    a, b = ([row[i] for row in rows] for i in range(2))
    for found in (mean(a), compare_paired_values(a, b).effect, compare_values(a, b).effect):
        assert found.low <= found.high
        assert found.value is None or found.low <= found.value <= found.high


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(AMOUNTS, AMOUNTS, AMOUNTS, AMOUNTS), max_size=12))
def test_no_amounts_raise_or_make_nan(rows: list[tuple[float | None, ...]]) -> None:
    a, b, c, d = ([row[i] for row in rows] for i in range(4))
    compared = compare_paired_ratios(a, b, c, d)
    assert 0 <= compared.p <= 1
    for found in (ratio_of_sums(a, b), compared.effect):
        assert 0 <= found.low <= found.high
        assert found.value is None or found.low <= found.value <= found.high


def test_the_same_numbers_make_the_same_interval() -> None:
    values = [3.0, 1, 4, 1, 5, 9, 2, 6]
    assert mean(values) == mean(values) != mean(values, seed=1)
    assert compare_paired_values(values * 3, [2.0] * 24).p == compare_paired_values(values * 3, [2.0] * 24).p


def test_tests_that_were_not_made_are_not_counted() -> None:
    assert holm([0.01, None, 0.04, NAN, 0.03]) == [pytest.approx(0.03), None, pytest.approx(0.06), None, 0.06]
    assert holm([]) == []


def test_games_are_matched_by_the_keys_that_both_have() -> None:
    assert common_values({1: 10.0, 2: 20.0, 3: None}, {3: 3.0, 2: 2.0, 4: 4.0}) == ([20.0, None], [2.0, 3.0])


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (lambda: wilson(3, 2), "3 of 2 games cannot be won"),
        (lambda: ratio_of_sums([1, 2], [1]), "pairs need as many values on each side, not 2 and 1"),
    ],
)
def test_what_cannot_be_is_refused(wrong: Callable[[], Interval], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        wrong()


# right as often as they say -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("games", [10, 20, 50])
def test_intervals_of_shares_hold_the_truth_in_95_percent(games: int) -> None:
    assert average_coverage(games) == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize("paired", [False, True])
def test_intervals_of_differences_hold_the_truth_in_95_percent(*, paired: bool) -> None:
    assert difference_coverage(20, paired=paired, times=500) == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize(
    ("times", "noise"), [(100, 0.07), pytest.param(1000, 0.02, marks=pytest.mark.slow)], ids=["few", "many"]
)
def test_bootstrap_intervals_hold_the_truth_nearly_as_often(times: int, noise: float) -> None:
    assert bootstrap_coverage("K/D", 20, times) == pytest.approx(0.94, abs=noise)
    assert bootstrap_coverage("normal", 20, times) == pytest.approx(0.95, abs=noise)


@pytest.mark.parametrize(
    ("games", "times"), [(5, 60), pytest.param(12, 120, marks=pytest.mark.slow)], ids=["few", "many"]
)
def test_tests_find_nothing_where_nothing_is(games: int, times: int) -> None:
    noise = 3 * math.sqrt(0.05 * 0.95 / times)
    for name, share in type_one_errors(games, times).items():
        assert share <= 0.05 + noise, name
