"""Workers that are ready before their match is known, each for one match."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from typing import TYPE_CHECKING, Protocol, Self

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from types import TracebackType

    from khala_sc2.playing.jobs import Ended, Job, MatchWorker

log = logging.getLogger(__name__)

REFILL_AFTER_S = 2.0
"""A worker gets ready in some seconds of two cores, which the match that has just begun needs first."""


class Player(Protocol):
    """What plays one match; a `MatchWorker`, or its double in tests."""

    @property
    def pid(self) -> int:
        """Of its process."""

    async def play(self, job: Job) -> Ended:
        """Play a match; return when it is over or the worker is gone."""

    def stop(self) -> None:
        """Have it end in order; `play` returns soon."""

    async def close(self) -> None:
        """End it, in order if there is time, and all of its processes."""


class Pool:
    """Keeps some workers ready. An async context manager that ends those that nobody took."""

    def __init__(self, warm: int, start: Callable[[], Awaitable[MatchWorker]]) -> None:
        self._warm = warm
        self._start = start
        self._ready: deque[MatchWorker] = deque()
        self._filling: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._refill(0.0)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._filling is not None:
            self._filling.cancel()
            await asyncio.gather(self._filling, return_exceptions=True)
        await asyncio.gather(*(worker.close() for worker in self._ready))

    async def take(self) -> MatchWorker:
        """Return a worker, the one that has waited longest, or a new one; another takes its place."""
        while self._ready:
            worker = self._ready.popleft()
            if worker.running:
                self._refill(REFILL_AFTER_S)
                return worker
            log.warning("a worker that waited for a match has ended; see above for its last words")
        self._refill(REFILL_AFTER_S)
        return await self._start()

    def _refill(self, after_s: float) -> None:
        if self._filling is None or self._filling.done():
            self._filling = asyncio.create_task(self._fill(after_s), name="start workers")

    async def _fill(self, after_s: float) -> None:
        await asyncio.sleep(after_s)
        while len(self._ready) < self._warm:
            self._ready.append(await self._start())
