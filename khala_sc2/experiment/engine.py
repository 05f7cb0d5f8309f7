"""Where matches are played: on this machine, several at a time, each in a process that plays many.

`khala_sc2.experiment.ray_engine` plays them on a Ray cluster instead.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import TYPE_CHECKING, Protocol, Self

import psutil

from khala_protocol.files import make_private
from khala_protocol.platforms import cores
from khala_sc2.playing.jobs import MatchWorker

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from khala_sc2.playing.jobs import Ended, Job

MATCH_MB = 450
"""Memory of a worker and its game; a full game of eight agents takes 400."""
MATCHES_OF_A_PROCESS = 100
"""Then a new process takes its place: whatever PySC2 or a policy leaves behind stays small."""


class Engine(Protocol):
    """Plays matches. An asynchronous context manager that ends what still runs."""

    slots: int
    """How many matches are played at the same time."""

    async def __aenter__(self) -> Self: ...

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    async def play(self, job: Job) -> Ended:
        """Play a match; its recording is where the job says when this returns."""


def slots_of_this_machine() -> int:
    """Return how many matches this machine plays at the same time: one a core, as far as there is memory."""
    return max(1, min(cores(), int(psutil.virtual_memory().available) // 2**20 // MATCH_MB))


class Local:
    """Plays matches on this machine."""

    def __init__(self, slots: int, *, game: str, logs: Path) -> None:
        """Take how many at a time, which game, and the directory for the logs of the processes."""
        self.slots = slots
        self._game = game
        self._logs = logs
        self._idle: list[MatchWorker] = []
        self._all: set[MatchWorker] = set()
        self._played: Counter[MatchWorker] = Counter()
        self._started = 0

    async def __aenter__(self) -> Self:
        make_private(self._logs)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await asyncio.gather(*(worker.close() for worker in self._all))

    async def play(self, job: Job) -> Ended:
        """Play a match in a process that is free, or in a new one."""
        worker = self._idle.pop() if self._idle else await self._start()
        self._played[worker] += 1
        try:
            ended = await worker.play(job)
        except BaseException:
            await self._end(worker)
            raise
        if ended.state in ("done", "error") and self._played[worker] < MATCHES_OF_A_PROCESS:
            self._idle.append(worker)
        else:
            await self._end(worker)
        return ended

    async def _start(self) -> MatchWorker:
        self._started += 1
        worker = await MatchWorker.start("--game", self._game, log=self._logs / f"worker-{self._started}.log")
        self._all.add(worker)
        return worker

    async def _end(self, worker: MatchWorker) -> None:
        self._all.discard(worker)
        del self._played[worker]
        await worker.close()
