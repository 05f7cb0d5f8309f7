"""Measure how often intervals hold the true value, and how often tests find what is not there.

    python -m bench intervals                     some minutes
    python -m bench intervals --times 100 --json

Wilson's interval is computed for every possible number of wins; all else is drawn by chance, with a fixed seed.
"""

from __future__ import annotations

import json
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats  # type: ignore[import-untyped]

from bench.command_line import make_parser
from khala_sc2.experiment.statistics import (
    compare_paired_ratios,
    compare_paired_values,
    compare_paired_wins,
    compare_values,
    compare_wins,
    difference_of_shares,
    mean,
    ratio_of_sums,
    wilson,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

GAMES = (5, 10, 20, 50)
SHARES = np.linspace(0.005, 0.995, 199)
LEVEL = 0.05
BOOTSTRAPS = {
    "normal": "mean of normal values",
    "skewed": "mean of skewed values (log-normal)",
    "K/D": "ratio of sums (gamma, each game with its own)",
}


def coverages(games: int) -> NDArray[np.float64]:
    """Return how often Wilson's interval holds the true share, for each of `SHARES`."""
    intervals = [wilson(won, games) for won in range(games + 1)]
    low, high = (np.array([getattr(interval, end) for interval in intervals])[:, None] for end in ("low", "high"))
    chances = stats.binom.pmf(np.arange(games + 1)[:, None], games, SHARES)
    return np.asarray((chances * ((low <= SHARES) & (high >= SHARES))).sum(axis=0))


def average_coverage(games: int) -> float:
    """Return how often Wilson's interval holds the true share, on average over all shares."""
    return float(coverages(games).mean())


def difference_coverage(games: int, *, paired: bool, times: int) -> float:
    """Return how often Newcombe's interval holds the true difference, of shares drawn by chance."""
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(times):
        # four outcomes of a pair; without pairs, the same with the columns drawn for themselves
        chances = rng.dirichlet([1, 1, 1, 1])
        true = chances[1] - chances[2]
        a, b = (rng.choice(4, games, p=chances) for _ in range(2))
        won_a, won_b = a % 2 == 1, (a if paired else b) >= 2
        if paired:
            effect = compare_paired_wins(won_a.tolist(), won_b.tolist()).effect
        else:
            effect = difference_of_shares(wilson(int(won_a.sum()), games), wilson(int(won_b.sum()), games))
        held += effect.low <= true <= effect.high
    return held / times


def bootstrap_coverage(of: str, games: int, times: int) -> float:
    """Return how often a bootstrap interval holds the true value."""
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(times):
        if of == "K/D":
            skill = rng.gamma(4, 1, games)
            found = ratio_of_sums(list(rng.gamma(2, 100, games) * skill), list(rng.gamma(2, 200, games)))
            true = 2.0
        elif of == "skewed":
            found = mean(list(rng.lognormal(0, 1, games)))
            true = float(np.exp(0.5))
        else:
            found = mean(list(rng.normal(size=games)))
            true = 0.0
        held += found.low <= true <= found.high
    return held / times


def type_one_errors(games: int, times: int) -> dict[str, float]:
    """Return how often each test finds a difference of two conditions that are the same."""
    rng = np.random.default_rng(1)

    @cache
    def boschloo(won_a: int, won_b: int) -> float:
        return compare_wins(won_a, games, won_b, games).p

    tests: dict[str, Callable[[], float]] = {
        "McNemar": lambda: compare_paired_wins(*(rng.random((2, games)) < 0.4).tolist()).p,
        "Boschloo": lambda: boschloo(*rng.binomial(games, 0.4, 2).tolist()),
        "paired permutation": lambda: compare_paired_values(*rng.lognormal(size=(2, games)).tolist()).p,
        "permutation": lambda: compare_values(*rng.lognormal(size=(2, games)).tolist()).p,
        "paired permutation of K/D": lambda: compare_paired_ratios(*rng.gamma(2, 100, (4, games)).tolist()).p,
    }
    return {name: sum(p() <= LEVEL for _ in range(times)) / times for name, p in tests.items()}


def tables(times: int) -> Iterator[tuple[str, list[float]]]:
    """Yield a name and a share for each of `GAMES`."""
    yield "share of wins (Wilson), average over all shares", [average_coverage(n) for n in GAMES]
    yield (
        "the same, shares of 10 to 90 %: the worst",
        [float(coverages(n)[(SHARES >= 0.1) & (SHARES <= 0.9)].min()) for n in GAMES],
    )
    yield "difference of shares (Newcombe)", [difference_coverage(n, paired=False, times=times) for n in GAMES]
    yield "the same of pairs", [difference_coverage(n, paired=True, times=times) for n in GAMES]
    for name, words in BOOTSTRAPS.items():
        yield f"{words} (bootstrap)", [bootstrap_coverage(name, n, times) for n in GAMES]
    errors = [type_one_errors(n, times) for n in GAMES]
    for name in errors[0]:
        yield f"found though not there: {name}", [error[name] for error in errors]


def main() -> None:
    """Print the table."""
    parser = make_parser(__doc__)
    parser.add_argument("--times", type=int, default=500, help="how often each is drawn")
    given = parser.parse_args()
    if given.json:
        print(json.dumps({"games": GAMES, "shares": dict(tables(given.times))}))
        return
    print(f"| | {' | '.join(f'{n} games' for n in GAMES)} |")
    print(f"|---|{'---:|' * len(GAMES)}")
    for name, shares in tables(given.times):
        print(f"| {name} | {' | '.join(f'{100 * share:.1f} %' for share in shares)} |", flush=True)
