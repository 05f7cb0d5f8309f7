"""What became of one match: its state, from what its recording says, and what of its run card is compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from khala_sc2.experiment.plan import FACTOR

if TYPE_CHECKING:
    from khala_protocol.messages import Run
    from khala_sc2.experiment.measures import Measures
    from khala_sc2.experiment.plan import PlannedMatch

State = Literal["done", "invalid", "crashed"]
"""`invalid`: it was played, and says nothing about its agents; `crashed`: it was not played to its end."""


@dataclass(frozen=True, slots=True)
class PlayedMatch:
    """What became of one match."""

    key: str
    cell: dict[str, str]
    seed: int
    repetition: int
    state: State
    cause: str
    """Why it is not `done`: `budget`, `crash`, `timeout`, `interrupted`, or the host's own words."""
    attempts: int
    recording: str
    """Relative to the directory of the experiment; empty if there is none."""
    wall_s: float | None
    cost_usd: float | None
    tokens: int | None
    card: dict[str, Any]
    """What of its run card must be the same in runs that are compared."""


def unread(match: PlannedMatch, attempts: int, cause: str, cost_usd: float | None) -> PlayedMatch:
    """Return what became of a match of which there is no recording that can be read."""
    return PlayedMatch(
        key=match.key, cell=match.cell, seed=match.seed, repetition=match.repetition, state="crashed", cause=cause,
        attempts=attempts, recording="", wall_s=None, cost_usd=cost_usd, tokens=None, card={},
    )  # fmt: skip


def judge(card: Run, rows: list[Measures], recording: str, attempts: int, crash: str) -> PlayedMatch:
    """Return what became of a recorded match, without its cost.

    Args:
        card: its run card.
        rows: its measures, of each episode and side.
        recording: where it is recorded.
        attempts: how often it was begun.
        crash: why it was not played to its end; "" if it seems it was.
    """
    state, cause = _state(rows, crash)
    labels = card.labels
    return PlayedMatch(
        key=labels.get("match", card.run),
        cell={name.removeprefix(FACTOR): value for name, value in labels.items() if name.startswith(FACTOR)},
        seed=card.seed,
        repetition=int(labels.get("repetition", "0")),
        state=state,
        cause=cause,
        attempts=attempts,
        recording=recording,
        wall_s=max((row.wall_s or 0.0 for row in rows), default=None),
        cost_usd=None,
        tokens=sum(row.prompt_tokens + row.completion_tokens for row in rows) if rows else None,
        card=comparable(card),
    )


def _state(rows: list[Measures], crash: str) -> tuple[State, str]:
    if crash or not rows or any(row.outcome == "unfinished" for row in rows):
        return "crashed", crash or "interrupted"
    if any("budget: " in row.undecided_because for row in rows):
        return "invalid", "budget"
    return "invalid" if (why := next((row.invalid_because for row in rows if not row.valid), "")) else "done", why


_OTHERWISE = frozenset({"clock", "executor", "opponent", "map", "scenes"})
"""Fields of a task that are compared by themselves, or that no agent notices."""


def comparable(card: Run) -> dict[str, Any]:
    """Return what of a run card must be the same in runs that are compared, by the names that `--allow` takes."""
    task = dict(card.config)
    return {
        "map": f"{card.map_name} {card.map_sha256}",
        "game": card.game,
        "opponent": card.opponent,
        "executor": card.executor,
        "clock": card.clock.model_dump(mode="json"),
        "actions": card.catalogue_sha256,
        "code": card.code_sha256,
        "versions": card.versions,
        "hardware": card.hardware,
        "task": {name: value for name, value in task.items() if name not in _OTHERWISE},
    }
