"""At which steps of a match it matters most who decides: forks at many of them, ranked by what changes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rich.table import Table

from khala_orchestrator.past.fork import ForkError
from khala_protocol.messages import LOOPS_PER_S
from khala_sc2.fork.figures import Figures, figures, of_side, plain, rate, recorded_figures

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_orchestrator.past.fork import Trunk
    from khala_sc2.fork.futures import Future

POINTS = 12
"""Steps of a scan if nothing else is said, or one less."""


@dataclass(frozen=True, slots=True)
class ForkPoint:
    """A step, and what became of the forks there, of the first side.

    Attributes:
        more_won: win rate of the forks, minus that of the recorded future.
        more_value: value killed minus value lost on average, less the same of the recorded future.
    """

    step: int
    game_s: float
    futures: Sequence[Future]
    found: Figures
    more_won: float
    more_value: float


def steps_of(trunk: Trunk, every: int | None, *, advised: bool = False) -> list[int]:
    """Return the steps to fork at, from the first one on.

    Args:
        trunk: the recorded episode.
        every: from one to the next; None for so many that there are `POINTS`.
        advised: whether agents are advised, which takes a step before.

    Raises:
        ForkError: the episode was not played to its end, so that there is nothing to compare with.
    """
    if not trunk.results:
        raise ForkError(f"{trunk.recording.path} has no end of episode {trunk.episode} to compare forks with")
    steps = len(trunk.loops)
    every = every or math.ceil(steps / POINTS)
    return [step for step in range(0, steps, every) if step or not advised]


def rank(trunk: Trunk, futures: Sequence[Future]) -> list[ForkPoint]:
    """Return the steps of forks, those first at which most changes: the win rate, then the value."""
    steps = dict.fromkeys(future.fork.step for future in futures)
    points = [_point(trunk, step, [future for future in futures if future.fork.step == step]) for step in steps]
    return sorted(points, key=lambda point: (-abs(point.more_won), -abs(point.more_value), point.step))


def _point(trunk: Trunk, step: int, futures: Sequence[Future]) -> ForkPoint:
    side = trunk.config.task.per_side()[0].side
    recorded = recorded_figures(trunk, side, step)
    assert recorded is not None, "steps_of has looked"
    found = figures(of_side(futures, side), from_loop=trunk.loop_at(step))
    return ForkPoint(
        step=step,
        game_s=trunk.loop_at(step) / LOOPS_PER_S,
        futures=futures,
        found=found,
        more_won=(found.win_rate or 0.0) - (recorded.win_rate or 0.0) if found.futures else 0.0,
        more_value=found.balance - recorded.balance if found.futures else 0.0,
    )


def table(points: Sequence[ForkPoint]) -> Table:
    """Return the steps in their order of rank."""
    shown = Table(box=None, pad_edge=False)
    for column in ("step", "game s", "futures", "win rate (95 %)", "than recorded", "killed - lost", "than recorded"):
        shown.add_column(column, justify="right", no_wrap=True)
    for point in points:
        shown.add_row(
            str(point.step), f"{point.game_s:.1f}", str(point.found.futures), rate(point.found),
            f"{100 * point.more_won:+.0f} %", f"{point.found.balance:+.0f}", f"{point.more_value:+.0f}",
        )  # fmt: skip
    return shown


def plain_points(trunk: Trunk, points: Sequence[ForkPoint]) -> list[dict[str, Any]]:
    """Return the steps in their order of rank, for JSON."""
    return [
        {"more_won": point.more_won, "more_value": point.more_value} | plain(trunk, point.step, point.futures)
        for point in points
    ]
