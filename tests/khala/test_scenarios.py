"""The maps of the paper, played by the scripted players through `khala run`: host, agents and model over the bus."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import pytest

from bench.matches.scenarios import PLAYERS, SHAME, Row, play, scenarios, table
from khala_protocol.messages import Report
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.game

SHORT = ("3s_vs_3z", "pvz_task1_level1", "pvz_task3_level1", "pvz_task6_level1")
"""Each takes seconds and is won with skills and distance; the first one represents all."""
ONE_LEVEL = [task for task in scenarios() if "_level" not in task]
ONE_LEVEL += [f"pvz_task{number}_level{1 + number % 3}" for number in range(1, 9)]
"""Each map, at one level; levels differ in numbers only."""


def played(task: str, player: str, out: Path, monkeypatch: pytest.MonkeyPatch) -> Row:
    monkeypatch.setenv("KHALA_CACHE", str(out / "cache"))
    row = play(task, player, episodes=1, seed=1, out=out)
    assert row.fault == ""
    assert not set(SHAME) & row.rejections.keys()
    assert row.accepted > 0
    assert len(list(Recording.open(row.recording).of(Report))) == row.steps
    return row


def test_there_are_33_of_them() -> None:
    assert len(scenarios()) == 33
    assert scenarios("pvz_task8*") == ["pvz_task8_level1", "pvz_task8_level2", "pvz_task8_level3"]


@pytest.mark.slow
@pytest.mark.parametrize("task", SHORT)
def test_the_skilled_player_wins(task: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    row = played(task, "skilled", tmp_path, monkeypatch)
    assert row.outcomes == {"win": 1}
    assert row.killed > 0


@pytest.mark.slow
@pytest.mark.parametrize(("task", "player"), list(zip(ONE_LEVEL, itertools.cycle(PLAYERS))))
def test_every_map_is_played_to_its_end(
    task: str, player: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = played(task, player, tmp_path, monkeypatch)
    assert row.outcomes.total() == 1


def test_a_run_that_fails_is_a_row_that_says_so(tmp_path: Path) -> None:
    row = play("nosuch", "skilled", episodes=1, seed=1, out=tmp_path)
    assert row.fault.startswith("khala: there is no task 'nosuch'")
    assert list(table([row]))[2].startswith("| nosuch | skilled | - | - |")
