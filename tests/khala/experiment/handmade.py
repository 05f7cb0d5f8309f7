"""Experiments made by hand: rows that no match was played for."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

from khala_sc2.experiment.measures import Measures
from khala_sc2.experiment.played import PlayedMatch
from khala_sc2.experiment.store import Store

if TYPE_CHECKING:
    from pathlib import Path

CARD: dict[str, Any] = {
    "map": "2s3z " + "0" * 64,
    "game": "Khala simulator 0.1.0, as 4.10.0.75689",
    "opponent": "computer (protoss, very_hard)",
    "executor": "raw",
    "clock": {"rule": "frozen", "max_wait_s": 15.0, "step_loops": 22},
    "actions": "a" * 64,
    "code": "c" * 64,
    "versions": {"khala": "0.1.0"},
    "hardware": {"cores": 2},
    "task": {"name": "2s3z", "rhythm": "paper", "max_actions": 3},
}
FILE = """
name: made
description: {description!r}
factors:
  task: {tasks}
  player: [{{name: skilled, model: scripted/skilled}}, {{name: focus, model: scripted/focus-fire}}]
seeds: {seeds}
"""


def measures(**values: Any) -> Measures:
    """Return a row in which all is 0 or nothing but what is given."""
    plain: dict[str, Any] = {"str": "", "int": 0, "float": 0.0, "bool": True}
    kinds = {name: str(field.type) for name, field in Measures.__dataclass_fields__.items()}
    row: Any = {name: None if "None" in kind else plain[kind] for name, kind in kinds.items()}
    return Measures(**row | values)


class HandMade:
    """An experiment to which matches are added one by one."""

    def __init__(self, directory: Path) -> None:
        self.store = Store(directory)
        directory.mkdir(parents=True, exist_ok=True)
        self.store._index.execute("pragma synchronous = off")
        self.describe()

    def describe(self, *, tasks: str = "[2s3z]", seeds: int = 20, description: str = "", more: str = "") -> None:
        text = FILE.format(tasks=tasks, seeds=seeds, description=description) + more
        (self.store.directory / "experiment.yaml").write_text(text)

    def add(
        self,
        cell: dict[str, str],
        seed: int,
        outcome: str = "win",
        *,
        state: Any = "done",
        cause: str = "",
        card: dict[str, Any] | None = None,
        **values: Any,
    ) -> None:
        """Add a match; `card` has fields that are other than those of `CARD`."""
        key = f"{'-'.join(cell.values())}-{seed}-{values.get('episode', 0)}"
        task = values.pop("task", cell.get("task", "2s3z"))
        played = PlayedMatch(key, cell, seed, 0, state, cause, 1, "", 4.0, None, 0, CARD | (card or {}))
        numbers = {"killed_value": 500.0, "lost_value": 250.0, "kd": 2.0, "steps": 20, "game_s": 20.0} | values
        rows = [measures(task=task, side="blue", seed=seed, outcome=outcome, **numbers)] if state != "crashed" else []
        self.store.add(played, [(row, []) for row in rows])

    def duel(self, cell: dict[str, str], seed: int, winner: str) -> None:
        """Add a match of two sides."""
        key = f"{'-'.join(cell.values())}-{seed}"
        numbers: dict[str, Any] = {
            "killed_value": 500.0,
            "lost_value": 250.0,
            "steps": 20,
            "game_s": 20.0,
            "seed": seed,
        }
        rows = [
            measures(task=cell["task"], side=side, outcome="win" if side == winner else "loss", **numbers)
            for side in ("blue", "red")
        ]
        self.store.add(
            PlayedMatch(key, cell, seed, 0, "done", "", 1, "", 4.0, None, 0, CARD), [(row, []) for row in rows]
        )

    def fill(self, wins: dict[str, set[int]], seeds: int = 20, *, task: str = "2s3z", **values: Any) -> None:
        """Add matches of players in a task; `wins` has the seeds with which each wins."""
        for player, won in wins.items():
            for seed in range(1, seeds + 1):
                drawn = random.Random(f"{player}{seed}{task}")
                killed = {"killed_value": drawn.randint(5, 12) * 50.0, "lost_value": drawn.randint(3, 12) * 50.0}
                outcome = "win" if seed in won else "loss"
                self.add({"task": task, "player": player}, seed, outcome, **killed | values)
