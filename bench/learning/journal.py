"""What a course keeps, in files of JSON lines, and what follows from it: no torch, and no game.

A line is written when it is known, so a process that is killed loses the one that it was writing.
"""

from __future__ import annotations

import json
from collections import defaultdict
from typing import TYPE_CHECKING, Any

from bench.learning.battles import Answer, Answered
from khala_protocol.messages import ChatMessage
from khala_sc2.experiment.statistics import mean, wilson

if TYPE_CHECKING:
    from pathlib import Path


class Journal:
    """What was done in a directory, in files of JSON lines.

    Args:
        directory: of the files; lines that were not written to their end are removed.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        directory.mkdir(parents=True, exist_ok=True)
        for path in directory.glob("*.jsonl"):
            text = path.read_text(encoding="utf-8")
            if not text.endswith("\n"):
                path.write_text(text[: text.rfind("\n") + 1], encoding="utf-8")

    def lines(self, name: str) -> list[dict[str, Any]]:
        """Return the lines of a file."""
        path = self._path(name)
        return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []

    def steps(self) -> list[dict[str, Any]]:
        """Return the line of each step; of one that was done again after a kill, the last."""
        return list({(line["stage"], line["step"]): line for line in self.lines("steps")}.values())

    def add(self, name: str, line: dict[str, Any]) -> None:
        """Write a line."""
        with self._path(name).open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")

    def _path(self, name: str) -> Path:
        return self._directory / f"{name}.jsonl"


def write_answered(answered: Answered) -> dict[str, Any]:
    """Return a prompt and its answer as a line."""
    prompt = [[message.role, message.content] for message in answered.prompt]
    return {"prompt": prompt, "answer": answered.answer.text, "tokens": list(answered.answer.tokens)}


def read_answered(line: dict[str, Any]) -> Answered:
    """Return what `write_answered` wrote; other fields are ignored."""
    prompt = tuple(ChatMessage(role=role, content=content) for role, content in line["prompt"])
    return Answered(prompt, Answer(line["answer"], tuple(line["tokens"])))


def summary(journal: Journal) -> list[dict[str, Any]]:
    """Return the test results of each player, in the order in which they were first tested."""
    by_player: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for line in journal.lines("tests"):
        by_player[line["player"]].append(line)
    found = []
    for player, lines in by_player.items():
        won = wilson(sum(line["won"] for line in lines), len(lines))
        reward = mean([line["reward"] for line in lines])
        obeyed = sum(line["obeyed"] for line in lines) / max(1, sum(line["answers"] for line in lines))
        found.append({
            "player": player, "battles": len(lines), "won": won.value, "low": won.low, "high": won.high,
            "reward": reward.value, "reward_low": reward.low, "reward_high": reward.high, "obeyed": obeyed,
        })  # fmt: skip
    return found
