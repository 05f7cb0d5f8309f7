"""Whether games scatter as their ratings say."""

from __future__ import annotations

import numpy as np

from khala_sc2.arena.misfit import CellOfGames, misfit_of


def test_games_that_scatter_as_they_should_are_seldom_called_strange() -> None:
    rng = np.random.default_rng(5)
    chances = [0.1, 0.3, 0.5, 0.7, 0.95]
    found = [
        misfit_of([CellOfGames(4, float(rng.binomial(4, chance)), chance) for chance in chances]) for _ in range(200)
    ]
    assert 0.02 < np.mean([fit is not None and fit.probability < 0.1 for fit in found]) < 0.18


def test_the_cell_that_fits_least_is_named() -> None:
    found = misfit_of([CellOfGames(6, 3.0, 0.5), CellOfGames(6, 0.0, 0.9), CellOfGames(6, 6.0, 0.8)])
    assert found is not None
    assert (found.probability, found.strangest) == (0.0, 1)


def test_no_games_say_nothing() -> None:
    assert misfit_of([]) is None
