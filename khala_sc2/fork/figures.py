"""What became of forks: numbers of one side, with intervals, and tables of them."""

from __future__ import annotations

import statistics
from collections import Counter
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from rich.table import Table

from khala_protocol.messages import LOOPS_PER_S
from khala_sc2.experiment.statistics import wilson

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from khala_orchestrator.past.fork import Trunk
    from khala_protocol.messages import Result
    from khala_sc2.fork.futures import Future


@dataclass(frozen=True, slots=True)
class Figures:
    """Futures of one side. Killed and lost are of the whole episode, the part before the step included.

    Attributes:
        futures: number of those that are valid, and are counted below.
        invalid: number of the others.
        win_rate: won / futures; None without any.
        low: lower bound of the interval in which the win rate lies with 95 % (Wilson).
        high: upper bound of it.
        kd: value killed / value lost, of all together; None if nothing was lost.
        balance: value killed minus value lost, on average.
        game_s: seconds of the game from the step to the end, the median.
    """

    futures: int
    invalid: int
    won: int
    drawn: int
    cut: int
    lost: int
    win_rate: float | None
    low: float
    high: float
    kd: float | None
    balance: float
    game_s: float


def figures(results: Iterable[Result], *, from_loop: int) -> Figures:
    """Return what became of futures that began at a game loop."""
    every = list(results)
    valid = [result for result in every if result.valid]
    endings = Counter(result.outcome for result in valid)
    number = len(valid)
    win_rate = wilson(endings["win"], number)
    killed, lost = sum(result.killed.value for result in valid), sum(result.lost.value for result in valid)
    return Figures(
        futures=number,
        invalid=len(every) - number,
        won=endings["win"],
        drawn=endings["draw"],
        cut=endings["cut"],
        lost=endings["loss"],
        win_rate=win_rate.value,
        low=win_rate.low,
        high=win_rate.high,
        kd=killed / lost if lost else None,
        balance=(killed - lost) / number if number else 0.0,
        game_s=statistics.median((r.game_loop - from_loop) / LOOPS_PER_S for r in valid) if number else 0.0,
    )


def of_side(futures: Iterable[Future], side: str) -> list[Result]:
    """Return the results of one side."""
    return [result for future in futures for result in future.results if result.side == side]


def recorded_figures(trunk: Trunk, side: str, step: int) -> Figures | None:
    """Return what became of the recorded future; None if it was not played to its end."""
    results = [result for result in trunk.results if result.side == side]
    return figures(results, from_loop=trunk.loop_at(step)) if results else None


def outcomes(trunk: Trunk, step: int, futures: Sequence[Future], who: str) -> Table:
    """Return a table of what became of the forks at a step, below what was recorded.

    Args:
        trunk: the recorded episode.
        step: of the forks.
        futures: what became of them; none to show what was recorded alone.
        who: who decided.
    """
    shown = Table(box=None, pad_edge=False)
    for column in (
        "decided by",
        "futures",
        "won",
        "drawn",
        "cut",
        "lost",
        "win rate (95 %)",
        "K/D",
        "killed - lost",
        "game s",
    ):
        shown.add_column(column, justify="left" if column == "decided by" else "right", no_wrap=True)
    sides = [task.side for task in trunk.config.task.per_side()]
    for side in sides:
        name = f"{side}: " if len(sides) > 1 else ""
        if recorded := recorded_figures(trunk, side, step):
            shown.add_row(f"{name}recorded", *_cells(recorded))
        if futures:
            of_forks = figures(of_side(futures, side), from_loop=trunk.loop_at(step))
            shown.add_row(f"{name}{who}", *_cells(of_forks))
    return shown


def _cells(found: Figures) -> list[str]:
    invalid = f" + {found.invalid} not valid" if found.invalid else ""
    return [
        f"{found.futures}{invalid}", str(found.won), str(found.drawn), str(found.cut), str(found.lost), rate(found),
        "none lost" if found.kd is None else f"{found.kd:.2f}", f"{found.balance:+.0f}", f"{found.game_s:.1f}",
    ]  # fmt: skip


def rate(found: Figures) -> str:
    """Return a win rate with its interval: `75 % (51 to 90)`."""
    if found.win_rate is None:
        return "unknown"
    return f"{100 * found.win_rate:.0f} % ({100 * found.low:.0f} to {100 * found.high:.0f})"


def are_alike(futures: Sequence[Future]) -> bool:
    """Return whether several futures are one and the same, as they are if who decides is deterministic."""
    ends = {
        tuple((result.side, result.outcome, result.game_loop, result.killed, result.lost) for result in future.results)
        for future in futures
    }
    return len(futures) > 1 and len(ends) == 1


def plain(trunk: Trunk, step: int, futures: Sequence[Future]) -> dict[str, Any]:
    """Return what became of the forks at a step, for JSON."""
    sides = [task.side for task in trunk.config.task.per_side()]
    recorded = {side: recorded_figures(trunk, side, step) for side in sides}
    of_forks = {side: figures(of_side(futures, side), from_loop=trunk.loop_at(step)) for side in sides}
    return {
        "step": step,
        "game_loop": trunk.loop_at(step),
        "recorded": {side: asdict(found) if found else None for side, found in recorded.items()},
        "forked": {side: asdict(found) for side, found in of_forks.items()},
        "forks": [_plain_fork(future) for future in futures],
    }


def _plain_fork(future: Future) -> dict[str, Any]:
    return {
        "run": future.fork.config.run,
        "recording": str(future.fork.record),
        "error": future.error,
        "decisions": future.decisions,
        "failed": future.failed,
        "spent_usd": future.spent_usd,
        "results": [result.model_dump(mode="json") for result in future.results],
    }
