"""A live picture of an experiment: how many matches are played, when it will end, what it has cost, what is on."""

from __future__ import annotations

import time
from collections import Counter
from typing import TYPE_CHECKING, Self

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from khala_sc2.experiment.runner import missing

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

    from rich.console import Console

    from khala_sc2.experiment.plan import PlannedMatch
    from khala_sc2.experiment.runner import Runner, RunnerEvent

SHOWN = 4
"""Matches that are named while they are played."""


class Watcher:
    """Shows the events of a runner: a bar on a terminal, a line for each match elsewhere."""

    def __init__(self, console: Console, runner: Runner, matches: Sequence[PlannedMatch], title: str) -> None:
        """Take where to show it, and the matches to be played."""
        self._console, self._runner = console, runner
        self._counts: Counter[str] = Counter()
        self._now: dict[str, str] = {}
        self._total = len(matches)
        left = len(list(missing(matches, runner.store.matches())))
        self._counts["before"] = self._total - left
        title_of, until, words = (
            TextColumn(text, markup=False) for text in ("{task.description}", "ends in", "{task.fields[words]}")
        )
        columns = (
            title_of,
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            until,
            TimeRemainingColumn(),
            words,
        )
        self._bar = Progress(*columns, console=console, disable=not console.is_terminal, transient=True)
        self._task = self._bar.add_task(title, total=left, words="")

    def __enter__(self) -> Self:
        self._bar.start()
        if self._counts["before"]:
            self._console.print(f"{self._counts['before']} of {self._total} matches were played before")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def __call__(self, event: RunnerEvent) -> None:
        """Show what happened."""
        if event.what == "begins":
            self._now[event.match.key] = event.match.title
        else:
            self._now.pop(event.match.key, None)
            self._tell(event)
        self._bar.update(self._task, words=self._activity(), advance=1.0 if event.what == "ends" else 0.0)

    def _tell(self, event: RunnerEvent) -> None:
        assert event.played is not None
        state = event.played.state
        if event.what == "ends":
            self._counts[state] += 1
        why = " · ".join(dict.fromkeys(filter(None, (event.played.cause, event.words))))
        because = f": {why}" if state != "done" else ""
        again = "; it is played again" if event.what == "again" else ""
        if state != "done" or not self._console.is_terminal:
            took = "" if event.played.wall_s is None else f" in {event.played.wall_s:.0f} s"
            when = time.strftime("%H:%M:%S")
            self._console.print(
                f"{when} {event.match.title}: {state}{took}{because}{again}", soft_wrap=True, highlight=False
            )

    def _activity(self) -> str:
        money = f"{self._runner.spent.usd:.4f} USD · " if self._runner.spent.usd else ""
        others = [f"{self._counts[state]} {state}" for state in ("invalid", "crashed") if self._counts[state]]
        playing = list(self._now.values())[:SHOWN]
        more = f" and {len(self._now) - SHOWN} more" if len(self._now) > SHOWN else ""
        return money + "".join(f"{part} · " for part in others) + "; ".join(playing) + more
