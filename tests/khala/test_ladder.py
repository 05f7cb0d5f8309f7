"""The table of games against the computer's levels."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bench.matches.ladder import Game, Pairing, table

if TYPE_CHECKING:
    from khala_bridge.task.maps import Difficulty, Race


def game(task: str, level: Difficulty, outcome: str, against: Race | None = None) -> Game:
    pairing = Pairing(task, against, level, 1, "skilled")
    return Game(pairing, outcome, steps=300, game_s=600.0, wall_s=100.0, accepted=500, rejected=5)


def test_each_task_and_opponent_has_a_row_and_each_level_a_column() -> None:
    played = [
        game("simple64_eceb", "easy", "win"),
        game("simple64_eceb", "easy", "loss"),
        game("simple64_eceb", "hard", "draw"),
        game("simple64_sceb_zerg", "easy", "win", "terran"),
        game("simple64_sceb_zerg", "hard", "win", "terran"),
    ]
    assert list(table(played)) == [
        "| task | against | easy | hard |",
        "|---|---|---|---|",
        "| `simple64_eceb` | zerg | 1 of 2 (9 to 91 %) | 0 of 1 (0 to 79 %) |",
        "| `simple64_sceb_zerg` | terran | 1 of 1 (21 to 100 %) | 1 of 1 (21 to 100 %) |",
    ]
