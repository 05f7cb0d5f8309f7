"""What is played to count games an hour."""

from __future__ import annotations

import pytest

from bench.matches.games_per_hour import TASKS, measures, plan_games
from khala_orchestrator.config import load_task


def test_games_have_seeds_of_their_own_and_full_games_end_after_seven_minutes() -> None:
    games = plan_games("simple64_eceb", 3)
    assert [game.seed for game in games] == [1, 2, 3]
    for game in games:
        task = game.config.task
        assert task.max_steps == pytest.approx(7 * 60 * 22.4 / task.clock.step_loops, rel=0.01)
    (battle,) = plan_games("2s3z_pair", 1)
    assert battle.config.task.max_steps == load_task("2s3z_pair").max_steps


def test_every_task_is_there() -> None:
    assert len(TASKS) == 6
    for name in TASKS:
        load_task(name)


def test_a_row_becomes_two_figures() -> None:
    row = {"task": "2s3z_pair", "at_once": 2, "per_hour": 1200.0, "cpu_s_a_game": 1.5}
    rate, cost = measures({"rows": [row]})
    assert (rate.name, rate.values, rate.better) == ("games an hour, 2s3z_pair, 2 at once", (1200.0,), "more")
    assert (cost.name, cost.values, cost.better) == ("processor time of a game, 2s3z_pair, 2 at once", (1.5,), "less")
