"""Workers of the service: processes that play one match each, and some that are ready for the next."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import signal
import subprocess
import sys
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, Self

from khala_protocol.parent_watch import named_parent

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence
    from types import TracebackType

    from khala.service.worker import Job

log = logging.getLogger(__name__)

END_S = 10.0
"""Time that a worker gets to end in order: it has agents, a game and a recording to close."""
REFILL_AFTER_S = 2.0
"""A worker gets ready in some seconds of two cores, which the match that has just begun needs first."""


@dataclass(frozen=True, slots=True)
class Ending:
    """How a worker ended."""

    state: str
    """`done`, `error`, `stopped`, or `lost`: it died without a word."""
    words: str = ""


class Player(Protocol):
    """What plays one match; a `Worker`, or its double in tests."""

    @property
    def pid(self) -> int:
        """Of its process."""

    async def play(self, job: Job) -> Ending:
        """Play a match; return when it is over or the worker is gone."""

    def stop(self) -> None:
        """Have it end in order; `play` returns soon."""

    async def close(self) -> None:
        """End it, in order if there is time, and all of its processes."""


class Worker:
    """One process that plays one match."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    @classmethod
    async def start(cls, arguments: Sequence[str]) -> Self:
        """Start a worker, which gets ready by itself. Its log goes to our stderr."""
        return cls(
            await asyncio.create_subprocess_exec(
                sys.executable,
                "-P",  # with no module of the current directory on its path
                "-m",
                "khala.service.worker",
                *arguments,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, **named_parent()},
                start_new_session=True,
            )
        )

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the process is there."""
        return self._process.returncode is None

    async def play(self, job: Job) -> Ending:
        """Play a match; return when it is over or the worker is gone."""
        assert self._process.stdin is not None and self._process.stdout is not None
        with contextlib.suppress(ConnectionError):
            self._process.stdin.write(job.model_dump_json().encode() + b"\n")
            await self._process.stdin.drain()
        last: dict[str, Any] = {}
        async for line in self._process.stdout:
            with contextlib.suppress(ValueError):
                last = json.loads(line)
        code = await self._process.wait()
        for state in ("done", "error", "stopped"):
            if state in last:
                return Ending(state, str(last[state]))
        how = signal.Signals(-code).name if code < 0 else f"code {code}"
        return Ending("lost", f"its worker ended with {how}")

    def stop(self) -> None:
        """Have it end in order."""
        with contextlib.suppress(ProcessLookupError):
            self._process.terminate()

    async def close(self) -> None:
        """End it; its own processes watch it, and end with it."""
        self.stop()
        try:
            async with asyncio.timeout(END_S):
                await self._process.wait()
        except TimeoutError:
            self._process.kill()
            await self._process.wait()


class Pool:
    """Keeps some workers ready. An async context manager that ends those that nobody took."""

    def __init__(self, warm: int, start: Callable[[], Awaitable[Worker]]) -> None:
        self._warm = warm
        self._start = start
        self._ready: deque[Worker] = deque()
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

    async def take(self) -> Worker:
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
