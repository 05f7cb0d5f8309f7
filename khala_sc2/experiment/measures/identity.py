"""Which episode a row is about, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from khala_protocol.messages import Result, Run
    from khala_sc2.experiment.measures.evidence import SideStep

UNFINISHED = "unfinished"
"""Outcome of an episode of which the recording has no result."""
NO_RESULT = "the recording ends before the episode does"
"""Why such an episode says nothing."""


@dataclass(frozen=True, kw_only=True)
class Identity:
    """Episode and result. A row is found by `run`, `episode` and `side`."""

    run: str
    """Name of the run."""
    task: str
    """Name of the task."""
    side: str
    """The side that the numbers are about."""
    episode: int
    """Number of the episode in its run, from 0."""
    seed: int
    """Seed of the episode: that of the run card, and 1 more for each episode."""
    map: str
    """Name of the map."""
    game: str
    """The game and its version, as on the run card."""
    clock: str
    """Rule of the clock: `frozen`, `budget`, `token` or `realtime`."""
    opponent: str
    """Who the side played against, in words."""
    outcome: str
    """`win`, `draw`, `loss`, `aborted` by the host, or `unfinished` if the recording has no result of the episode."""
    cause: str
    """Why it ended, such as `enemy defeated`; empty if it is unfinished."""
    valid: bool
    """Whether the episode says something about its agents; false if it is unfinished."""
    invalid_because: str
    """Why it does not; empty if it does."""
    steps: int
    """Steps of the side."""
    game_s: float
    """Seconds on the game's clock."""
    wall_s: float | None
    """Seconds of wall time; None if it is unfinished, like all that follows."""
    killed_value: float | None
    """Minerals and vespene that the killed units had cost."""
    killed_units: int | None
    """Number of units killed."""
    lost_value: float | None
    """Minerals and vespene that the lost units had cost."""
    lost_units: int | None
    """Number of units lost."""
    kd: float | None
    """Value killed / value lost; None if nothing was lost."""
    score: float | None
    """The game's score at the end."""


class EpisodeProgress:
    """How far an episode was played; for one without a result there is nothing else."""

    def __init__(self) -> None:
        self._steps = self._loop = 0

    def add(self, step: SideStep) -> None:
        """Take in a step."""
        self._steps += 1
        self._loop = step.report.game_loop

    def total(self, run: Run, side: str, episode: int, result: Result | None) -> Identity:
        """Return the group."""
        return Identity(
            run=run.run,
            task=run.task,
            side=side,
            episode=episode,
            seed=run.seed + episode,
            map=run.map_name,
            game=run.game,
            clock=run.clock.rule,
            opponent=result.opponent if result else _opponent(run, side),
            outcome=result.outcome if result else UNFINISHED,
            cause=result.cause if result else "",
            valid=result is not None and result.valid,
            invalid_because=result.invalid_because if result else NO_RESULT,
            steps=self._steps,
            game_s=result.game_s if result else self._loop / LOOPS_PER_S,
            wall_s=result.wall_s if result else None,
            killed_value=result.killed.value if result else None,
            killed_units=result.killed.units if result else None,
            lost_value=result.lost.value if result else None,
            lost_units=result.lost.units if result else None,
            kd=result.kd if result else None,
            score=result.score if result else None,
        )


def _opponent(run: Run, side: str) -> str:
    """Return who a side plays against, as a result would say it."""
    others = sorted({agent.side for agent in run.agents} - {side})
    return run.opponent or ", ".join(f"side {other}" for other in others)
