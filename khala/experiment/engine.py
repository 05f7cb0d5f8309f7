"""Where matches are played: on this machine, several at a time, each in a process that plays many.

`khala.experiment.ray_engine` plays them on a Ray cluster instead.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Protocol, Self

import psutil
from pydantic import ValidationError

from khala.experiment.job import Done
from khala_protocol.files import make_private, open_private
from khala_protocol.parent_watch import named_parent

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

    from khala.experiment.job import Job

MATCH_MB = 450
"""Memory of a worker and its game; a full game of eight agents takes 400."""
MATCHES_OF_A_PROCESS = 100
"""Then a new process takes its place: whatever PySC2 or a policy leaves behind stays small."""
END_S = 10.0


class Engine(Protocol):
    """Plays matches. An asynchronous context manager that ends what still runs."""

    slots: int
    """How many matches are played at the same time."""

    async def __aenter__(self) -> Self: ...

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    async def play(self, job: Job) -> Done:
        """Play a match; its recording is where the job says when this returns."""


def slots_of_this_machine() -> int:
    """Return how many matches this machine plays at the same time: one a core, as far as there is memory."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(cores, int(psutil.virtual_memory().available) // 2**20 // MATCH_MB))


class Local:
    """Plays matches on this machine."""

    def __init__(self, slots: int, *, game: str, logs: Path) -> None:
        """Take how many at a time, which game, and the directory for the logs of the processes."""
        self.slots = slots
        self._game, self._logs = game, logs
        self._free: list[_Process] = []
        self._all: set[_Process] = set()
        self._started = 0

    async def __aenter__(self) -> Self:
        make_private(self._logs)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await asyncio.gather(*(process.close() for process in list(self._all)))

    async def play(self, job: Job) -> Done:
        """Play a match in a process that is free, or in a new one."""
        process = self._free.pop() if self._free else await self._start()
        try:
            done = await process.play(job)
        except BaseException:
            await self._end(process)
            raise
        if done.state in ("lost", "timeout") or process.played >= MATCHES_OF_A_PROCESS:
            await self._end(process)
        else:
            self._free.append(process)
        return done

    async def _start(self) -> _Process:
        self._started += 1
        process = await _Process.start(self._game, self._logs / f"worker-{self._started}.log")
        self._all.add(process)
        return process

    async def _end(self, process: _Process) -> None:
        self._all.discard(process)
        await process.close()


class _Process:
    """A process that plays one match at a time."""

    def __init__(self, process: asyncio.subprocess.Process, log: Path) -> None:
        self._process, self._log = process, log
        self.played = 0

    @classmethod
    async def start(cls, game: str, log: Path) -> Self:
        with open_private(log, "ab") as stderr:
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-P", "-m", "khala.experiment.worker", "--game", game,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr,
                env={**os.environ, **named_parent()}, start_new_session=True, limit=2**24,
            )  # fmt: skip
        return cls(process, log)

    async def play(self, job: Job) -> Done:
        """Play a match; return when it is over, or the process is gone."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self.played += 1
        with contextlib.suppress(ConnectionError):
            self._process.stdin.write(job.model_dump_json().encode() + b"\n")
            await self._process.stdin.drain()
        while line := await self._process.stdout.readline():
            with contextlib.suppress(ValidationError):  # a policy may print
                return Done.model_validate_json(line)
        code = await self._process.wait()
        how = signal.Signals(-code).name if code < 0 else f"code {code}"
        return Done(state="lost", words=f"its process ended with {how}; {self._log} has its last words")

    async def close(self) -> None:
        """End the process; its game watches it, and ends with it."""
        with contextlib.suppress(ProcessLookupError):
            self._process.terminate()
        try:
            async with asyncio.timeout(END_S):
                await self._process.wait()
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()
