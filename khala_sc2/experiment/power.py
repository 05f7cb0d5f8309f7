"""How many games are needed, before any or with some played: for an interval so wide, to tell two conditions apart.

Pure functions of shares, on the intervals and tests of `khala_sc2.experiment.statistics`. All return the whole number of
games, those already played included.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats  # type: ignore[import-untyped]

from khala_sc2.experiment.statistics import CONFIDENCE, deviations, wilson_bounds

if TYPE_CHECKING:
    from collections.abc import Callable

POWER = 0.8
"""How often a difference that exists should be found: the usual convention (Cohen 1988)."""


def games_for_half_width(half_width: float, *, share: float = 0.5, confidence: float = CONFIDENCE) -> int:
    """Return how many games make a Wilson interval at most so wide to both sides; a share of 0.5 needs the most."""
    if half_width <= 0:
        raise ValueError(f"no number of games makes an interval of half width {half_width:g}; it must be above 0")

    def enough(games: int) -> bool:
        low, high = wilson_bounds(share, games, confidence)
        return high - low <= 2 * half_width

    return _least(enough)


def games_to_separate(share_a: float, share_b: float, *, confidence: float = CONFIDENCE) -> int:
    """Return how many games a side make the Wilson intervals of two such shares not overlap."""
    low, high = _apart(share_a, share_b)
    return _least(lambda games: wilson_bounds(low, games, confidence)[1] < wilson_bounds(high, games, confidence)[0])


def games_for_power(share_a: float, share_b: float, *, power: float = POWER, confidence: float = CONFIDENCE) -> int:
    """Return how many games a side show the difference of two such shares with this power, without pairs.

    The usual normal approximation (Fleiss 1981, without correction), which Boschloo's test comes near to.
    """
    low, high = _apart(share_a, share_b)
    middle = (low + high) / 2
    detect = float(stats.norm.ppf(power))
    null, real = 2 * middle * (1 - middle), low * (1 - low) + high * (1 - high)
    return math.ceil(((deviations(confidence) * math.sqrt(null) + detect * math.sqrt(real)) / (high - low)) ** 2)


def pairs_for_power(only_a: float, only_b: float, *, power: float = POWER, confidence: float = CONFIDENCE) -> int:
    """Return how many pairs make McNemar's exact test show a difference with this power.

    Args:
        only_a: share of pairs that `a` alone wins.
        only_b: share of pairs that `b` alone wins.
        power: how often the difference should be found.
        confidence: 1 minus the level of the test.
    """
    _apart(only_a, only_b)
    return _least(lambda pairs: mcnemar_power(pairs, only_a, only_b, confidence=confidence) >= power)


def mcnemar_power(pairs: int, only_a: float, only_b: float, *, confidence: float = CONFIDENCE) -> float:
    """Return how often McNemar's exact test finds a difference between shares of pairs that one alone wins."""
    unequal = only_a + only_b
    low, high = stats.binom.ppf([1e-12, 1 - 1e-12], pairs, unequal)
    m = np.arange(max(0, low), high + 1)
    critical = stats.binom.ppf((1 - confidence) / 2, m, 0.5)
    critical -= stats.binom.cdf(critical, m, 0.5) > (1 - confidence) / 2
    found = stats.binom.cdf(critical, m, only_a / unequal) + stats.binom.cdf(critical, m, only_b / unequal)
    return float((stats.binom.pmf(m, pairs, unequal) * found).sum())


def _apart(a: float, b: float) -> tuple[float, float]:
    if a == b or not 0 <= min(a, b) <= max(a, b) <= 1:
        raise ValueError(f"no number of games separates {a:g} from {b:g}; it takes two different shares from 0 to 1")
    return min(a, b), max(a, b)


def _least(enough: Callable[[int], bool]) -> int:
    """Return the first number of games that is enough."""
    most = 1
    while not enough(most):
        most *= 2
    return 1 + bisect_left(range(1, most + 1), x=True, key=enough)
