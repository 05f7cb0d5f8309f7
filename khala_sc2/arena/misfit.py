"""Whether games scatter as their ratings say: a test of the fit, by simulation.

Ratings give each pair of players one chance for all tasks of a group. If a player is good at one task and bad at
another, its games scatter more than chance explains, and its rating is a mean that holds on neither.

Pure functions on numpy: nothing here knows a match, a task or the scale of ratings.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

TIMES = 2000
"""Simulated arenas; the smallest probability that can be told from 0 is 1 / TIMES."""


class CellOfGames(NamedTuple):
    """The games of two players on one task."""

    games: int
    points: float
    """Of the first player."""
    chance: float
    """That the first player wins a game, by the ratings."""


class Misfit(NamedTuple):
    """How well cells fit their chances."""

    probability: float
    """That games with these chances scatter at least as much."""
    strangest: int
    """Index of the cell that fits least."""


def misfit_of(cells: Sequence[CellOfGames]) -> Misfit | None:
    """Return how well cells fit their chances, by Pearson's statistic; None if there are none.

    Its distribution is simulated, since cells have few games. The ratings were fitted to the same games, which takes
    some of the scatter away, and so do draws: the true probability is rather smaller than the one returned.
    """
    if not cells:
        return None
    games, points, chance = (np.array(column, dtype=float) for column in zip(*cells, strict=True))
    expected = games * chance
    variance = expected * (1 - chance)
    found = (points - expected) ** 2 / variance
    drawn = np.random.default_rng(0).binomial(games.astype(int), chance, size=(TIMES, len(cells)))
    simulated = ((drawn - expected) ** 2 / variance).sum(axis=1)
    return Misfit(float((simulated >= found.sum()).mean()), int(found.argmax()))
