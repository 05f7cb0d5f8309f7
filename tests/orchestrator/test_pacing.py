"""A game that goes on with the wall clock; on a clock that jumps."""

from __future__ import annotations

import asyncio

import pytest

from khala_orchestrator.match.pacing import AtOnce, WallClock, pacing_of
from khala_protocol.messages import LOOPS_PER_S, Clock

CLOCK = "jumps"


def now_s() -> float:
    return asyncio.get_running_loop().time()


async def test_a_loop_takes_its_time() -> None:
    pacing = WallClock(speed=2.0)
    pacing.begin()
    assert [await pacing.until(loop) for loop in (100, 100 + 2 * 224, 100 + 3 * 224)] == [0, 0, 0]
    assert now_s() == pytest.approx(3 * 224 / (2 * LOOPS_PER_S))


async def test_what_is_lost_is_not_made_up_for() -> None:
    pacing = WallClock(speed=1.0)
    pacing.begin()
    await pacing.until(0)
    await asyncio.sleep(15)
    assert await pacing.until(224) == pytest.approx(5)
    assert await pacing.until(448) == pytest.approx(5)
    assert now_s() == pytest.approx(25)


async def test_an_episode_begins_without_the_lag_of_the_one_before() -> None:
    pacing = WallClock(speed=1.0)
    pacing.begin()
    await pacing.until(0)
    await asyncio.sleep(15)
    await pacing.until(1)
    pacing.begin()
    assert await pacing.until(5000) == 0


@pytest.mark.parametrize("rule", ["frozen", "budget", "token"])
async def test_only_real_time_waits(rule: str) -> None:
    assert isinstance(pacing_of(Clock.model_validate({"rule": rule})), AtOnce)
    assert isinstance(pacing_of(Clock(rule="realtime")), WallClock)
