"""Ratings from games: one Bradley-Terry fit, with intervals.

A player of strength a beats one of strength b with the probability 1 / (1 + exp(b - a)). A draw is half a win for both.
Strengths are fitted by Firth's method (Biometrika 80, 1993): the likelihood is multiplied by Jeffreys' prior, so that a
player who has won or lost all of its games gets a finite strength, and the bias of small samples goes. Intervals are
those of the profile of this likelihood (Heinze and Schemper 2002), which stay right where a player has hardly lost.

Pure functions on numpy and scipy: nothing here knows a match, a file or the scale of ratings.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy import optimize, stats  # type: ignore[import-untyped]

from khala_sc2.experiment.statistics import CONFIDENCE

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    Floats: TypeAlias = NDArray[np.float64]

STEPS = 200
"""Most steps of Newton's method; ten are usual."""
LONGEST_STEP = 2.0
"""Longest change of a strength in one step, in natural units: 350 Elo."""
ACCURACY = 1e-7
FARTHEST = 40.0
"""Natural units from an estimate in which the end of its interval is looked for: 7000 Elo."""


@dataclass(frozen=True, slots=True)
class RatedGame:
    """What became of a game."""

    first: str
    second: str
    score: float
    """Of the first player: 1 for a win, 0.5 for a draw, 0 for a loss."""


@dataclass(frozen=True, slots=True)
class Strength:
    """How strong a player is, in natural units above the mean of the anchors, and between which bounds that lies."""

    value: float
    low: float
    high: float


def fit_strengths(games: Iterable[RatedGame], anchors: Sequence[str]) -> dict[str, Strength]:
    """Return the strength of every player whom games connect with an anchor.

    Two players are connected if they have met, or have both met a third one. Anchors that are not connected with the
    first anchor that has played are left out, and so is everybody else.

    Args:
        games: in any order.
        anchors: players whose mean strength is 0.
    """
    games = list(games)
    players = _reachable(games, anchors)
    if len(players) < 2:
        return {}
    fit = _Fit(players, [name for name in anchors if name in players], games)
    return {name: fit.strength(name) for name in players}


def _reachable(games: Sequence[RatedGame], anchors: Sequence[str]) -> list[str]:
    """Return the players whom games connect with the first anchor that has played, in the order of their games."""
    met: dict[str, set[str]] = defaultdict(set)
    for game in games:
        met[game.first].add(game.second)
        met[game.second].add(game.first)
    waiting = [name for name in anchors if name in met][:1]
    found = set(waiting)
    while waiting:
        new = met[waiting.pop()] - found
        found |= new
        waiting += new
    return [name for name in met if name in found]


class _Fit:
    """The likelihood of the games of some players, and its maximum.

    `design` has a row for each pair that has met and a column for each player: 1 for the first of the pair, -1 for the
    second. The last anchor has no parameter of its own: it is what makes the mean of the anchors 0.
    """

    def __init__(self, players: Sequence[str], anchors: Sequence[str], games: Iterable[RatedGame]) -> None:
        self._players = list(players)
        self._anchors = list(anchors)
        number: dict[tuple[str, str], float] = defaultdict(float)
        points: dict[tuple[str, str], float] = defaultdict(float)
        for game in games:
            if game.first in self._players:
                pair = game.first, game.second
                number[pair] += 1.0
                points[pair] += game.score
        self._games = np.array(list(number.values()))
        self._points = np.array([points[pair] for pair in number])
        self._pairs = list(number)
        self._free = self._free_of(self._anchors[-1])
        self._design = self._design_of(self._anchors[-1])
        self._best = self._maximum(self._design, np.zeros(len(self._pairs)))
        self._most = self._likelihood(self._design @ self._best, self._design)

    def strength(self, name: str) -> Strength:
        """Return the strength of a player; that of an only anchor is 0 by definition."""
        if self._anchors == [name]:
            return Strength(0.0, 0.0, 0.0)
        last = next(anchor for anchor in reversed(self._anchors) if anchor != name)
        design = self._design_of(last)
        column = self._free_of(last).index(name)
        value = self._value(name)
        low, high = (self._bound(design, column, value, direction) for direction in (-1.0, 1.0))
        return Strength(value, low, high)

    def _value(self, name: str) -> float:
        known = dict(zip(self._free, self._best, strict=True))
        if name in known:
            return float(known[name])
        return -float(sum(known[anchor] for anchor in self._anchors if anchor != name))

    def _free_of(self, last: str) -> list[str]:
        return [name for name in self._players if name != last]

    def _design_of(self, last: str) -> Floats:
        free = self._free_of(last)
        rows = np.zeros((len(self._pairs), len(free)))
        for row, pair in zip(rows, self._pairs, strict=True):
            for name, sign in zip(pair, (1.0, -1.0), strict=True):
                for column, weight in _columns(name, last, free, self._anchors):
                    row[column] += sign * weight
        return rows

    def _bound(self, design: Floats, column: int, value: float, direction: float) -> float:
        """Return where the profile of the likelihood falls below the limit of the confidence."""
        drop = float(stats.chi2.ppf(CONFIDENCE, 1)) / 2
        others = np.delete(design, column, axis=1)
        start = np.zeros(others.shape[1])

        def excess(distance: float) -> float:
            nonlocal start
            offset = design[:, column] * (value + direction * distance)
            start = self._maximum(others, offset, start, design)
            return self._likelihood(others @ start + offset, design) - self._most + drop

        far = 0.5
        while far < FARTHEST and excess(far) > 0:
            far *= 2
        if far >= FARTHEST:
            return direction * math.inf
        return value + direction * float(optimize.brentq(excess, 0.0, far, xtol=1e-4))

    def _maximum(
        self, design: Floats, offset: Floats, start: Floats | None = None, whole: Floats | None = None
    ) -> Floats:
        """Return the parameters of the largest likelihood, by Newton's method with steps that never go down.

        The prior is like half a win and half a loss more in each pair, times its leverage, and counts in the curvature
        so: without that, steps of players with a single game are twice too long, and the search goes in circles.

        Args:
            design: of the free parameters.
            offset: what the other one adds to the logit of each pair.
            start: of the search.
            whole: the design with all parameters, of which the prior is; `design` if none is fixed.
        """
        whole = design if whole is None else whole
        parameters = np.zeros(design.shape[1]) if start is None else start
        reached = self._likelihood(design @ parameters + offset, whole)
        for _ in range(STEPS if parameters.size else 0):
            step = self._step(design, design @ parameters + offset, whole)
            while (found := self._likelihood(design @ (parameters + step) + offset, whole)) < reached - ACCURACY:
                step = step / 2
            parameters = parameters + step
            reached = found
            if np.abs(step).max() < ACCURACY:
                break
        return parameters

    def _step(self, design: Floats, logits: Floats, whole: Floats) -> Floats:
        """Return a step of Newton's method towards the largest likelihood."""
        chance = _logistic(logits)
        weights = self._games * chance * (1 - chance)
        spread = np.linalg.inv(whole.T @ (weights[:, None] * whole))
        leverage = weights * np.einsum("ij,jk,ik->i", whole, spread, whole)
        score = design.T @ (self._points - self._games * chance + leverage * (0.5 - chance))
        weights += leverage * chance * (1 - chance)
        step = np.linalg.solve(design.T @ (weights[:, None] * design), score)
        shorter: Floats = step * min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), ACCURACY))
        return shorter

    def _likelihood(self, logits: Floats, design: Floats) -> float:
        chance = _logistic(logits)
        weights = self._games * chance * (1 - chance)
        _, information = np.linalg.slogdet(design.T @ (weights[:, None] * design))
        likelihood = self._points * np.log(chance) + (self._games - self._points) * np.log1p(-chance)
        return float(likelihood.sum() + 0.5 * information)


def _columns(name: str, last: str, free: list[str], anchors: list[str]) -> Iterator[tuple[int, float]]:
    """Yield the parameters that a player's strength is made of, with their weights."""
    if name != last:
        yield free.index(name), 1.0
        return
    yield from ((free.index(anchor), -1.0) for anchor in anchors if anchor != last)


def _logistic(logits: Floats) -> Floats:
    return 1 / (1 + np.exp(-np.clip(logits, -500, 500)))
