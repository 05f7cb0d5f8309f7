"""Counting duels: seats, and games that do not count."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING, Any

import pytest

from bench.matches import duels
from bench.matches.duels import Game, table

if TYPE_CHECKING:
    from pathlib import Path


def game(side: str, outcome: str, *, valid: bool = True) -> Game:
    return Game(1, side, outcome, killed=100, lost=50, steps=10, wall_s=1.0, valid=valid)


def test_games_are_counted_by_seat_and_only_if_they_are_valid() -> None:
    games = [game("blue", "win"), game("blue", "draw"), game("red", "loss"), game("red", "win", valid=False)]
    assert list(table("x", "y", games))[2:] == [
        "| all | 3 | 1 (6 to 79 %) | 1 (6 to 79 %) | 1 | 2.00 | 30 | 1 |",
        "| x is blue | 2 | 1 (9 to 91 %) | 0 (0 to 66 %) | 1 | 2.00 | 20 | 0 |",
        "| x is red | 1 | 0 (0 to 79 %) | 1 (21 to 100 %) | 0 | 2.00 | 10 | 1 |",
    ]


@pytest.mark.parametrize(("b", "seeds"), [("y", ["1", "1"]), ("x", ["1", "3"])])
def test_sides_are_swapped_and_only_different_players_meet_twice_on_a_seed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, b: str, seeds: list[str]
) -> None:
    said: list[list[str]] = []

    def run(command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        said.append(command)
        return subprocess.CompletedProcess(command, 0, stdout='{"results": []}', stderr="")

    monkeypatch.setattr("bench.matches.duels.subprocess.run", run)
    assert duels.duels("duel_3m", "x", b, games=3, seed=1, out=tmp_path) == []
    assert [command[command.index("--seed") + 1] for command in said] == seeds
    assert [command[command.index("--episodes") + 1] for command in said] == ["2", "1"]
    assert [[part for part in command if "=" in part] for command in said] == [
        ["blue=x", f"red={b}"],
        [f"blue={b}", "red=x"],
    ]


@pytest.mark.game
@pytest.mark.slow
def test_a_player_who_acts_beats_one_who_does_not_from_both_seats(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("KHALA_CACHE", str(tmp_path / "cache"))
    played = duels.duels("duel_3m", "focus-fire", "silent", games=2, seed=1, out=tmp_path / "runs")
    assert [(one.seed, one.side, one.outcome, one.valid) for one in played] == [
        (1, "blue", "win", True),
        (1, "red", "win", True),
    ]
