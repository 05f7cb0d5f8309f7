"""Files that are made to do harm are read or refused: some of what `python -m bench.hostile_files` tries."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bench.hostile_files import files, recordings

if TYPE_CHECKING:
    from pathlib import Path


def test_mutated_task_model_and_agents_files_are_read_or_refused(tmp_path: Path) -> None:
    tally = files(100, 3, tmp_path)
    assert tally.violations == []
    assert 0 < tally.read < tally.cases


def test_mutated_recordings_are_read_as_far_as_they_go(tmp_path: Path) -> None:
    tally = recordings(20, 3, tmp_path)
    assert tally.violations == []
    assert tally.cases == 20


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12])
def test_many_mutated_files_are_read_or_refused(seed: int, tmp_path: Path) -> None:
    assert files(2000, seed, tmp_path).violations == []
    assert recordings(500, seed, tmp_path).violations == []
