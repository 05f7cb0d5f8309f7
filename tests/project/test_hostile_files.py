"""Files that are made to do harm are read or refused: some of what `python -m bench hostile_files` tries."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bench.survival.hostile_files import SLOWEST_MS, Tally, files, recordings, scenarios

if TYPE_CHECKING:
    from collections.abc import Callable
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


@pytest.mark.parametrize(("took_s", "judged_ms"), [((9.0, 0.1, 0.2), 100), ((9.0, 8.0, 7.0), 7000), ((0.2,), 200)])
def test_a_case_is_slow_only_if_it_is_so_every_time(
    took_s: tuple[float, ...], judged_ms: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    tally = Tally()
    tally.judge("a case", _taking(took_s, monkeypatch))
    assert tally.slowest_ms == pytest.approx(judged_ms)
    assert (tally.cases, tally.read) == (1, 1)


def _taking(took_s: tuple[float, ...], monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Return a case that takes this CPU time, run by run, by a clock of its own."""
    now_s = 0.0
    runs = iter(took_s)
    monkeypatch.setattr("bench.survival.hostile_files.time.process_time", lambda: now_s)

    def case() -> None:
        nonlocal now_s
        now_s += next(runs)

    return case


@pytest.mark.slow
def test_many_mutated_files_are_read_or_refused(tmp_path: Path) -> None:
    for tally in (files(2000, 11, tmp_path), scenarios(2000, 11, tmp_path), recordings(500, 11, tmp_path)):
        assert tally.violations == []
        assert tally.slowest_ms < LIMIT_MS
