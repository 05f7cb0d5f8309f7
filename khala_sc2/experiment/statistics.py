"""How sure a number is: intervals and tests.

Pure functions of numbers, on scipy; nothing here knows what a match is. `docs/design/statistics.md` says which question
needs which function, and why.

A game without the number (None, NaN, infinite) is left out, and `Interval.n` says how many remained. Where data say
nothing, intervals are as wide as can be, `Interval.value` is None and p is 1; nothing raises and nothing is NaN.
What is drawn by chance has a fixed seed: the same numbers give the same interval.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
from scipy import stats  # type: ignore[import-untyped]

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Mapping, Sequence

    from numpy.typing import NDArray

    Floats: TypeAlias = NDArray[np.float64]
    Key = TypeVar("Key", bound=Hashable)

CONFIDENCE = 0.95
RESAMPLES = 9999
"""Of a bootstrap, and of a permutation test with more than so many permutations."""
BOSCHLOO_GAMES = 200
"""Boschloo's test takes 0.2 s with so many games, and 5 s with 1000; with more games Fisher's is nearly as powerful."""


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate, and between which bounds the true value lies."""

    value: float | None
    """None without data."""
    low: float
    high: float
    n: int
    """Games, or pairs of games."""
    confidence: float = CONFIDENCE


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two conditions, `a` and `b`."""

    test: str
    """Which test was made."""
    effect: Interval
    """The value of `a` minus that of `b`; of two ratios, `a` divided by `b`."""
    p: float
    """How often so large an effect is seen if there is none."""


# data -----------------------------------------------------------------------------------------------------------------


def common_values(
    a: Mapping[Key, float | None], b: Mapping[Key, float | None]
) -> tuple[list[float | None], list[float | None]]:
    """Return the values of keys, such as seeds, that both have, in the order of `a`."""
    keys = [key for key in a if key in b]
    return [a[key] for key in keys], [b[key] for key in keys]


def _known(*columns: Sequence[float | None]) -> list[Floats]:
    """Return the columns without the rows in which a value is missing."""
    if len({len(column) for column in columns}) > 1:
        raise ValueError(f"pairs need as many values on each side, not {' and '.join(str(len(c)) for c in columns)}")
    rows = np.array(columns, dtype=np.float64)  # None becomes NaN
    return list(rows[:, np.isfinite(rows).all(axis=0)])


# shares ---------------------------------------------------------------------------------------------------------------


def wilson(won: int, games: int, *, confidence: float = CONFIDENCE) -> Interval:
    """Return the share of games won with its interval (Wilson 1927)."""
    if not 0 <= won <= games:
        raise ValueError(f"{won} of {games} games cannot be won")
    if not games:
        return Interval(None, 0.0, 1.0, 0, confidence)
    return Interval(won / games, *wilson_bounds(won / games, games, confidence), games, confidence)


def wilson_bounds(share: float, games: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the bounds of the true share; for games not yet played, `share` times `games` need not be whole."""
    spread = deviations(confidence) ** 2 / games
    middle = share + spread / 2
    width = math.sqrt(spread * (share * (1 - share) + spread / 4))
    low, high = (middle - width) / (1 + spread), (middle + width) / (1 + spread)
    return max(0.0, low) if share else 0.0, min(1.0, high) if share < 1 else 1.0


def deviations(confidence: float) -> float:
    """Return of how many standard deviations around its mean a normal distribution has this share."""
    return float(stats.norm.ppf((1 + confidence) / 2))


def difference_of_shares(
    a: Interval, b: Interval, *, correlation: float = 0.0, confidence: float = CONFIDENCE
) -> Interval:
    """Return the difference of two Wilson intervals of the same confidence (Newcombe 1998).

    `correlation` is that of wins in the same pair, for paired games.
    """
    n = min(a.n, b.n)
    if a.value is None or b.value is None:
        return Interval(None, -1.0, 1.0, n, confidence)
    difference = a.value - b.value
    below = _side(a.value - a.low, b.high - b.value, correlation)
    above = _side(a.high - a.value, b.value - b.low, correlation)
    return Interval(difference, max(-1.0, difference - below), min(1.0, difference + above), n, confidence)


def _side(one: float, other: float, correlation: float) -> float:
    return math.sqrt(max(0.0, one**2 + other**2 - 2 * correlation * one * other))


def compare_wins(won_a: int, games_a: int, won_b: int, games_b: int, *, confidence: float = CONFIDENCE) -> Comparison:
    """Compare wins in games that are not paired, by Boschloo's exact test, or Fisher's when there are many."""
    a, b = (wilson(won, n, confidence=confidence) for won, n in ((won_a, games_a), (won_b, games_b)))
    effect = difference_of_shares(a, b, confidence=confidence)
    table = [[won_a, won_b], [games_a - won_a, games_b - won_b]]
    boschloo = games_a + games_b <= BOSCHLOO_GAMES
    name = "Boschloo's exact test" if boschloo else "Fisher's exact test"
    if not games_a or not games_b or not any(table[0]) or not any(table[1]):
        return Comparison(name, effect, 1.0)
    p = (stats.boschloo_exact if boschloo else stats.fisher_exact)(table).pvalue
    return Comparison(name, effect, min(1.0, float(p)))


def compare_paired_wins(
    a: Sequence[float | None], b: Sequence[float | None], *, confidence: float = CONFIDENCE
) -> Comparison:
    """Compare wins (True or 1) in games that are paired, such as by seed, by McNemar's exact test."""
    x, y = (column.astype(bool) for column in _known(a, b))
    only_a, only_b = int((x & ~y).sum()), int((y & ~x).sum())
    of_a, of_b = (wilson(int(wins.sum()), len(wins), confidence=confidence) for wins in (x, y))
    correlation = _correlation(int((x & y).sum()), only_a, only_b, int((~x & ~y).sum()))
    effect = difference_of_shares(of_a, of_b, correlation=correlation, confidence=confidence)
    p = float(stats.binomtest(only_a, only_a + only_b).pvalue) if only_a + only_b else 1.0
    return Comparison("McNemar's exact test", effect, p)


def _correlation(both: int, only_a: int, only_b: int, neither: int) -> float:
    """Return the correlation of two columns of wins, a positive one corrected for continuity (Newcombe's method 10)."""
    margins = (both + only_a) * (only_b + neither) * (both + only_b) * (only_a + neither)
    product = float(both * neither - only_a * only_b)
    if product > 0:
        product = max(0.0, product - (both + only_a + only_b + neither) / 2)
    return product / math.sqrt(margins) if margins else 0.0


# numbers --------------------------------------------------------------------------------------------------------------


def mean(values: Sequence[float | None], *, confidence: float = CONFIDENCE, seed: int = 0) -> Interval:
    """Return the mean with its bootstrap interval, which has no width if all values are equal."""
    (known,) = _known(values)
    value = float(known.mean()) if len(known) else None
    low, high = _bootstrap(_mean, (known,), confidence, seed) if len(known) > 1 else (-math.inf, math.inf)
    return Interval(value, low, high, len(known), confidence)


def ratio_of_sums(
    over: Sequence[float | None], under: Sequence[float | None], *, confidence: float = CONFIDENCE, seed: int = 0
) -> Interval:
    """Return the ratio of two sums over the same games with its bootstrap interval, such as K/D of killed and lost.

    The numbers are not negative. The ratio is infinite if all games are without losses, None if nothing was killed
    either. A sum of nothing says nothing of how much it might be: the interval is then 0 to infinity.
    """
    killed, lost = _known(over, under)
    return _ratio(_quotient(killed.sum(), lost.sum()), _angle, (killed, lost), confidence, seed)


def _quotient(over: float, under: float) -> float | None:
    if under:
        with np.errstate(over="ignore"):  # infinite it is
            return float(np.float64(over) / under)
    return math.inf if over else None


def _ratio(
    value: float | None, angle: Callable[..., Floats], columns: tuple[Floats, ...], confidence: float, seed: int
) -> Interval:
    """Return a ratio of sums over columns with the bootstrap interval of its angle, or 0 to infinity."""
    n = len(columns[0])
    if value is None or n < 2 or not all(column.any() for column in columns):
        return Interval(value, 0.0, math.inf, n, confidence)
    low, high = (math.tan(bound) for bound in _bootstrap(angle, columns, confidence, seed))
    # The tangent of a right angle, all games without losses, is 1.6e16 in floating point; no game has such a ratio.
    return Interval(value, min(low, value), max(high, value) if high < 1e12 else math.inf, n, confidence)


def _mean(values: Floats, axis: int) -> Floats:
    return np.asarray(values.mean(axis=axis))


def _angle(over: Floats, under: Floats, axis: int) -> Floats:
    """Return the ratio as an angle, which is finite without losses too; percentiles are the same on both scales."""
    return np.asarray(np.arctan2(over.sum(axis=axis), under.sum(axis=axis)))


def _difference(a: Floats, b: Floats, axis: int) -> Floats:
    return np.asarray(a.mean(axis=axis) - b.mean(axis=axis))


def _bootstrap(
    statistic: Callable[..., Floats], samples: tuple[Floats, ...], confidence: float, seed: int, *, paired: bool = True
) -> tuple[float, float]:
    """Return the BCa interval, at the level that is right for a normal mean of few values (Hesterberg 2015)."""
    options: dict[str, Any] = {"vectorized": True, "paired": paired, "n_resamples": RESAMPLES}
    n = min(len(sample) for sample in samples)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)  # all resamples are equal: NaN, see below
        found = stats.bootstrap(
            samples, statistic, **options, confidence_level=_level(confidence, n), rng=np.random.default_rng(seed)
        ).confidence_interval
    same = float(statistic(*samples, axis=-1))
    low, high = float(found.low), float(found.high)
    return (min(low, same), max(high, same)) if math.isfinite(low + high) else (same, same)


def _level(confidence: float, n: int) -> float:
    student = stats.t.ppf((1 + confidence) / 2, n - 1) * math.sqrt(n / (n - 1))
    return min(1 - 1e-9, float(1 - 2 * stats.norm.sf(student)))


def compare_values(
    a: Sequence[float | None], b: Sequence[float | None], *, confidence: float = CONFIDENCE, seed: int = 0
) -> Comparison:
    """Compare means of games that are not paired, by a permutation test."""
    (x,), (y,) = _known(a), _known(b)
    n = min(len(x), len(y))
    value = float(x.mean() - y.mean()) if len(x) and len(y) else None
    if n < 2:
        return Comparison("permutation test", Interval(value, -math.inf, math.inf, n, confidence), 1.0)
    bounds = _bootstrap(_difference, (x, y), confidence, seed, paired=False)
    return Comparison("permutation test", Interval(value, *bounds, n, confidence), p_of_values(a, b, seed=seed))


def p_of_values(a: Sequence[float | None], b: Sequence[float | None], *, seed: int = 0) -> float:
    """Return the p of `compare_values` alone, which takes a tenth of its time."""
    (x,), (y,) = _known(a), _known(b)
    return _permutation(_difference, (x, y), "independent", seed) if min(len(x), len(y)) > 1 else 1.0


def compare_paired_values(
    a: Sequence[float | None], b: Sequence[float | None], *, confidence: float = CONFIDENCE, seed: int = 0
) -> Comparison:
    """Compare means of games that are paired, such as by seed, by a paired permutation test."""
    x, y = _known(a, b)
    effect = mean(list(x - y), confidence=confidence, seed=seed)
    return Comparison("paired permutation test", effect, _flips(x - y, seed))


def compare_paired_ratios(
    over_a: Sequence[float | None],
    under_a: Sequence[float | None],
    over_b: Sequence[float | None],
    under_b: Sequence[float | None],
    *,
    confidence: float = CONFIDENCE,
    seed: int = 0,
) -> Comparison:
    """Compare ratios of sums, such as K/D, of games that are paired, by a paired permutation test.

    What is permuted is what each game is above the ratio of all games of both, which no permutation changes.
    """
    a, b, c, d = _known(over_a, under_a, over_b, under_b)
    value = _quotient(a.sum() * d.sum(), b.sum() * c.sum())
    effect = _ratio(value, _angle_of_quotient, (a, b, c, d), confidence, seed)
    pooled = _quotient((a + c).sum(), (b + d).sum())
    if pooled is None or math.isinf(pooled):
        return Comparison("paired permutation test", effect, 1.0)
    return Comparison("paired permutation test", effect, _flips((a - c) - pooled * (b - d), seed))


def _angle_of_quotient(a: Floats, b: Floats, c: Floats, d: Floats, axis: int) -> Floats:
    return np.asarray(np.arctan2(a.sum(axis=axis) * d.sum(axis=axis), b.sum(axis=axis) * c.sum(axis=axis)))


def _flips(differences: Floats, seed: int) -> float:
    """Return p of a mean of 0, by changes of sign."""
    return _permutation(_mean, (differences,), "samples", seed) if len(differences) > 1 else 1.0


def _permutation(statistic: Callable[..., Floats], samples: tuple[Floats, ...], kind: str, seed: int) -> float:
    """Return p, exact if there are at most `RESAMPLES` permutations."""
    found = stats.permutation_test(
        samples,
        statistic,
        permutation_type=kind,
        vectorized=True,
        n_resamples=RESAMPLES,
        rng=np.random.default_rng(seed),
    )
    return float(found.pvalue)


def variation_of_ratio(over: Sequence[float | None], under: Sequence[float | None]) -> float | None:
    """Return how much the logarithm of a ratio of sums varies from game to game, as a standard deviation.

    It is that of each game's share of both sums (delta method): with n games, the logarithm of their ratio has this
    deviation divided by the root of n. None with fewer than two games or a sum of nothing.
    """
    killed, lost = _known(over, under)
    if len(killed) < 2 or not killed.any() or not lost.any():
        return None
    return float((killed / killed.mean() - lost / lost.mean()).std(ddof=1))


def p_of_published_ratio(
    ratio: float | None, variation: float | None, games: int, published: float, published_games: int
) -> float | None:
    """Return p of a ratio of sums against a published one, of which nothing but the number of games is known.

    Both are assumed to vary alike from game to game: the difference of their logarithms, divided by its standard
    error from our games, has Student's distribution. None if a ratio is 0 or infinite, or if our games do not vary.
    """
    if not ratio or not variation or not published or math.isinf(ratio) or math.isinf(published):
        return None
    error = variation * math.sqrt(1 / games + 1 / published_games)
    return float(2 * stats.t.sf(abs(math.log(ratio / published)) / error, games - 1))


# many tests -----------------------------------------------------------------------------------------------------------


def holm(p_values: Sequence[float | None]) -> list[float | None]:
    """Return each p as it is among so many (Holm 1979); None and NaN are tests that were not made."""
    made = [i for i, p in enumerate(p_values) if p is not None and not math.isnan(p)]
    p = np.array([p_values[i] for i in made], dtype=np.float64)
    order = np.argsort(p, kind="stable")
    stepped = np.minimum(1.0, np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)))
    corrected = {made[i]: float(value) for i, value in zip(order, stepped, strict=True)}
    return [corrected.get(i) for i in range(len(p_values))]
