"""The rules of the clock with a real game: they repeat, their recordings replay, and real time is real."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import pytest

from bench.clocks import RULES, measure, play
from bench.pace import measure as measure_pace
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.messages import LOOPS_PER_S, Report
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.game

SPEED = 8.0
JITTER_S = 0.05
"""A step begins when its time has come, and takes its time stamp a moment later."""


async def test_the_tokens_of_a_match_and_not_the_time_they_took_decide_it(tmp_path: Path) -> None:
    (row,) = await measure("2s3z_pair", [1], tmp_path, rules=("token",), max_steps=6)
    assert row.violations() == []
    assert min(row.played[-1].ages_loops) > 0


@pytest.mark.slow
@pytest.mark.timeout(400)
@pytest.mark.parametrize("seed", [2, 3])
async def test_a_match_repeats_under_every_rule_that_waits_and_replays_under_all(seed: int, tmp_path: Path) -> None:
    rows = await measure("2s3z_pair", [seed], tmp_path)
    assert [row.rule for row in rows] == list(RULES)
    assert [row.violations() for row in rows] == [[]] * len(RULES)


async def test_in_real_time_the_wall_clock_decides_and_the_recording_replays(tmp_path: Path) -> None:
    task = change(load_task("2s3z_pair"), rule="realtime", speed=SPEED, max_steps=24)
    played = await play(MatchConfig(task=task, run="real"), tmp_path / "real.mcap", 0.3)
    assert played.differences == 0
    assert min(played.ages_loops) > 0
    reports = [(sample.log_time_ns / 1e9, sample.message) for sample in Recording.open(tmp_path / "real.mcap")]
    ended = [(at_s, report) for at_s, report in reports if isinstance(report, Report)]
    began_s = [at_s - report.timings.act_s - report.timings.game_s for at_s, report in ended]
    for (earlier, one), (later, other) in pairwise(zip(began_s, (report for _, report in ended), strict=True)):
        due_s = (one.game_loop - _before(one, ended)) / (LOOPS_PER_S * SPEED)
        lost_s = other.timings.lag_s - one.timings.lag_s
        assert later - earlier >= due_s + lost_s - JITTER_S


def _before(report: Report, ended: list[tuple[float, Report]]) -> int:
    """Return the game loop at which a step began: the one at which the step before it ended."""
    return ended[report.step - 1][1].game_loop if report.step else 0


@pytest.mark.slow
@pytest.mark.timeout(200)
async def test_agents_of_every_pace_play_in_one_match(tmp_path: Path) -> None:
    figures = await measure_pace((0.1, 0.4, 1.0, 3.0), 30, tmp_path, speed=2)
    decisions = [agent.decisions for agent in figures.agents]
    assert decisions == sorted(decisions, reverse=True)
    assert decisions[0] > 5 * decisions[-1] > 0
    assert [agent.late for agent in figures.agents] == [0, 0, 0, 0]
    assert [agent.age_p50_loops >= int(agent.sleep_s * LOOPS_PER_S * 2) for agent in figures.agents] == [True] * 4
