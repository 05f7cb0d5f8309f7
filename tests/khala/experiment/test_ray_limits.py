"""The gate of an endpoint on a cluster, without a cluster."""

from __future__ import annotations

import asyncio

import pytest

from khala_agents.llm.limits import LimitRules

CLOCK = "jumps"
pytestmark = pytest.mark.slow  # importing Ray takes a second


async def test_a_request_whose_node_died_gives_its_place_back_and_a_refused_one_says_why() -> None:
    pytest.importorskip("ray")
    from khala_sc2.experiment.ray_limits import LEASE_S, LimitRefusal, SharedTurns

    turns = SharedTurns(LimitRules(in_flight=1, requests_per_minute=600), "model file m")
    left = await turns.enter(1, None)
    assert isinstance(left, int)
    await turns.leave(left, 0)
    await turns.enter(1, None)  # and never leaves
    await turns.enter(1, None)
    assert asyncio.get_running_loop().time() == LEASE_S

    slow = SharedTurns(LimitRules(requests_per_minute=1), "model file m")
    await slow.enter(1, None)
    assert await slow.enter(1, 30) == LimitRefusal("requests_per_minute", 2, 1, "model file m")
