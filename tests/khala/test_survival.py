"""A match goes on whatever is taken away from it: small runs of the benches, which say what they break and judge."""

from __future__ import annotations

import asyncio

import pytest

from bench.survival import faults, orphans, resume, soak

pytestmark = [pytest.mark.game, pytest.mark.slow, pytest.mark.timeout(900)]

PATIENCE_S = 120.0
"""Tests run beside others, under coverage, on slow machines: the benches themselves are stricter about time."""


def test_a_match_with_faults_executes_nothing_twice_and_keeps_its_deadlines() -> None:
    kinds = ["agent stopped", "agent's link cut", "host's link cut", "router restarted", "endpoint away",
             "agent killed", "game killed", "host killed"]  # fmt: skip
    verdict = faults.measure(40, seed=11, only=kinds, recovery_s=PATIENCE_S)
    assert set(kinds) < set(verdict.counted)
    assert verdict.is_good(most_late=0.5, too_late_s=2.0), faults.summary(verdict)
    assert verdict.held


def test_a_match_whose_host_is_killed_ends_as_if_nothing_had_happened() -> None:
    resumed = asyncio.run(resume.measure(2, seed=11, only=("frozen", "realtime")))
    assert resumed.is_good, resumed
    assert len(resumed.kills) == 3


def test_a_long_match_neither_grows_nor_loses_a_decision() -> None:
    soaked = asyncio.run(soak.measure(400, agents=4))
    assert soaked.is_good(most_growth=10.0, most_grown_mb=100.0), soaked
    assert soaked.decisions == 400


def test_no_process_outlives_a_killed_match() -> None:
    assert orphans.is_good(orphans.measure(2, seed=11), gone_s=orphans.GIVEN_UP_S - 1)
