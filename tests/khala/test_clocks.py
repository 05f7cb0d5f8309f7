"""The rules of the clock with a real game: they repeat, their recordings replay, and real time is real."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bench.matches.clocks import RULES, measure, play
from bench.matches.pace import measure as measure_pace
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.messages import LOOPS_PER_S, Report
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.game

SPEED = 8.0


@pytest.mark.slow
async def test_the_tokens_of_a_match_and_not_the_time_they_took_decide_it(tmp_path: Path) -> None:
    (row,) = await measure("2s3z_pair", [1], tmp_path, rules=("token",), max_steps=4)
    assert row.violations() == []
    assert min(row.played[-1].ages_loops) > 0


@pytest.mark.slow
async def test_a_match_repeats_under_every_rule_that_waits_and_replays_under_all(tmp_path: Path) -> None:
    rows = await measure("2s3z_pair", [2], tmp_path)
    assert [row.rule for row in rows] == list(RULES)
    assert [row.violations() for row in rows] == [[]] * len(RULES)


@pytest.mark.slow
async def test_in_real_time_the_wall_clock_decides_and_the_recording_replays(tmp_path: Path) -> None:
    task = change(load_task("2s3z_pair"), rule="realtime", speed=SPEED, max_steps=12)
    played = await play(MatchConfig(task=task, run="real"), tmp_path / "real.mcap", 0.3)
    assert played.differences == 0
    assert min(played.ages_loops) > 0
    *_, last_but_one, last = Recording.open(tmp_path / "real.mcap").of(Report)
    due_s = last_but_one.game_loop / (LOOPS_PER_S * SPEED)  # when the last step was to begin
    assert played.result.wall_s >= due_s + last.timings.lag_s


@pytest.mark.slow
async def test_agents_of_every_pace_play_in_one_match(tmp_path: Path) -> None:
    figures = await measure_pace((0.1, 0.4, 1.0, 3.0), 30, tmp_path, speed=2)
    decisions = [agent.decisions for agent in figures.agents]
    assert decisions == sorted(decisions, reverse=True)
    assert decisions[0] > 5 * decisions[-1] > 0
    assert [agent.late for agent in figures.agents] == [0, 0, 0, 0]
    ages_loops = [agent.age_p50_loops for agent in figures.agents]
    assert ages_loops == sorted(ages_loops)
