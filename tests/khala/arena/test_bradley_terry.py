"""Strengths and their intervals, against players of known strength."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import pytest

from khala_sc2.arena.bradley_terry import RatedGame, fit_strengths

if TYPE_CHECKING:
    from collections.abc import Sequence


def simulate(
    strengths: Sequence[float], games: int, rng: np.random.Generator, *, draws: float = 0.0
) -> list[RatedGame]:
    """Return so many games of each pair of players, who are named by their numbers."""
    played = []
    for a, b in itertools.combinations(range(len(strengths)), 2):
        chance = 1 / (1 + np.exp(strengths[b] - strengths[a]))
        for _ in range(games):
            score = 0.5 if rng.random() < draws else float(rng.random() < chance)
            played.append(RatedGame(str(a), str(b), score))
    return played


def coverage(
    strengths: Sequence[float], games: int, *, anchors: Sequence[str], times: int, draws: float = 0.0
) -> float:
    """Return which part of the intervals contains the true strength."""
    rng = np.random.default_rng(7)
    zero = np.mean([strengths[int(name)] for name in anchors])
    held = []
    for _ in range(times):
        found = fit_strengths(simulate(strengths, games, rng, draws=draws), anchors)
        held += [
            found[name].low <= strengths[int(name)] - zero <= found[name].high
            for name in found
            if list(anchors) != [name]
        ]
    return sum(held) / len(held)


def test_nineteen_of_twenty_intervals_contain_the_true_strength() -> None:
    assert 0.92 <= coverage([0.0, 0.5, 1.0, 2.0], 8, anchors=["0"], times=60) <= 0.98


@pytest.mark.slow
@pytest.mark.parametrize(
    ("strengths", "games", "anchors"),
    [
        ([0.0, 0.5, 1.0, 1.5, 2.5], 8, ["0"]),
        ([0.0, 0.5, 1.0, 1.5, 2.5], 8, ["0", "3"]),
        ([0.0, 2.0, 4.0, 5.0, -1.0], 4, ["0"]),  # some win or lose all of their games
        ([0.3 * number for number in range(10)], 3, ["0"]),
    ],
)
def test_intervals_are_right_for_few_games_several_anchors_and_unequal_players(
    strengths: list[float], games: int, anchors: list[str]
) -> None:
    assert 0.93 <= coverage(strengths, games, anchors=anchors, times=100) <= 0.98


@pytest.mark.slow
def test_draws_make_intervals_wider_than_they_need_be_and_never_narrower() -> None:
    assert coverage([0.0, 0.0, 0.0, 0.0], 8, anchors=["0"], times=200, draws=0.4) >= 0.95


def test_many_games_give_the_strengths_that_they_were_played_with() -> None:
    truth = [0.0, 0.7, -0.4, 1.5]
    found = fit_strengths(simulate(truth, 4000, np.random.default_rng(1)), ["0"])
    assert [found[str(player)].value for player in range(4)] == pytest.approx(truth, abs=0.1)
    assert (found["0"].low, found["0"].high) == (0.0, 0.0)


def test_a_player_who_has_won_every_game_has_a_finite_strength_and_an_interval_that_is_longer_upwards() -> None:
    found = fit_strengths([RatedGame("a", "b", 1.0)] * 5, ["b"])["a"]
    assert 1.0 < found.value < 4.0
    assert found.high - found.value > found.value - found.low
    assert np.isfinite(found.high)


def test_players_of_a_single_game_have_the_strength_of_one_win_and_a_half_and_half_a_loss() -> None:
    """With steps that were too long the search went in circles here, and then the interval had no end."""
    lost = [RatedGame("a", name, 1.0) for name in "bcdefghi"] + [RatedGame("z", name, 0.0) for name in "bc"]
    found = fit_strengths(lost, ["a"])
    for name in "defghi":
        assert found[name].value == pytest.approx(-np.log(3), abs=1e-5)
        assert found[name].low < found[name].value < found[name].high < 2.0


def test_several_anchors_share_the_zero_and_each_has_an_interval() -> None:
    games = simulate([0.0, 1.0, 2.0], 20, np.random.default_rng(2))
    alone = fit_strengths(games, ["0"])
    found = fit_strengths(games, ["0", "2"])
    assert found["0"].value + found["2"].value == pytest.approx(0.0, abs=1e-6)
    assert found["1"].value - found["0"].value == pytest.approx(alone["1"].value, abs=1e-5)
    assert found["0"].low < found["0"].value < found["0"].high


def test_seats_and_the_order_of_games_change_nothing() -> None:
    games = simulate([0.0, 1.0, 2.0], 6, np.random.default_rng(3))
    turned = [RatedGame(game.second, game.first, 1 - game.score) for game in reversed(games)]
    ours, theirs = (fit_strengths(found, ["0"]) for found in (games, turned))
    for name, strength in ours.items():
        assert theirs[name].value == pytest.approx(strength.value, abs=1e-5)
        assert theirs[name].high == pytest.approx(strength.high, abs=1e-2)


@pytest.mark.parametrize("anchors", [["x"], ["nobody"], []])
def test_players_whom_no_games_connect_with_an_anchor_have_no_strength(anchors: list[str]) -> None:
    games = [RatedGame("a", "b", 1.0), RatedGame("b", "c", 0.5), RatedGame("x", "y", 0.0)]
    assert set(fit_strengths(games, anchors)) == ({"x", "y"} if anchors == ["x"] else set())
