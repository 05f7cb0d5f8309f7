"""Files that are made to do harm are read or refused: some of what `python -m bench.hostile_files` tries."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bench.hostile_files import SLOWEST_MS, files, recordings, scenarios

if TYPE_CHECKING:
    from pathlib import Path

LIMIT_MS = 4 * SLOWEST_MS
"""Tests run beside others, under coverage, on slow machines: the bench itself is stricter."""


def test_mutated_task_model_and_agents_files_are_read_or_refused(tmp_path: Path) -> None:
    tally = files(100, 3, tmp_path)
    assert tally.violations == []
    assert tally.slowest_ms < LIMIT_MS
    assert 0 < tally.read < tally.cases


def test_mutated_scenarios_are_read_or_refused(tmp_path: Path) -> None:
    tally = scenarios(100, 3, tmp_path)
    assert tally.violations == []
    assert tally.slowest_ms < LIMIT_MS
    assert 0 < tally.read < tally.cases


def test_mutated_recordings_are_read_as_far_as_they_go(tmp_path: Path) -> None:
    tally = recordings(20, 3, tmp_path)
    assert tally.violations == []
    assert tally.slowest_ms < LIMIT_MS
    assert tally.cases == 20


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12])
def test_many_mutated_files_are_read_or_refused(seed: int, tmp_path: Path) -> None:
    for tally in (files(2000, seed, tmp_path), scenarios(2000, seed, tmp_path), recordings(500, seed, tmp_path)):
        assert tally.violations == []
        assert tally.slowest_ms < LIMIT_MS
