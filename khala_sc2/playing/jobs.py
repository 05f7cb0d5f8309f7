"""Matches in a process of their own, as its parent sees them: a job goes in, and how it ended comes out.

Each job is a line of JSON on the stdin of the process, and each ending a line on its stdout. `khala_sc2.playing.worker` is
the process. Above: experiments, whose processes play many matches, and the service, whose processes play one.
"""

from __future__ import annotations

import contextlib
import os
import signal
from pathlib import Path  # noqa: TC003  # pydantic evaluates it
from typing import TYPE_CHECKING, Literal, Self

from khala_orchestrator.config import MatchConfig  # noqa: TC001
from khala_protocol.bus.config import BusConfig  # noqa: TC001
from khala_protocol.messages import Frozen
from khala_protocol.platforms import ask_to_end
from khala_sc2.playing.minds import Minds  # noqa: TC001  # pydantic evaluates it
from khala_sc2.playing.processes import end_process, start_process

if TYPE_CHECKING:
    import asyncio

END_S = 10.0
"""Time that a worker gets to end in order: it has agents, a game and a recording to close."""


class Job(Frozen):
    """One match to play. It is recorded at `config.record`."""

    config: MatchConfig
    minds: dict[str, Minds]
    """By side, with its budget."""
    timeout_s: float | None = None
    """How long it may take; None for any time."""
    processes: bool = False
    """Whether agents get processes of their own."""
    bus: BusConfig | None = None
    """The router that a match with processes joins; None for one of its own."""
    beginning: Path | None = None
    """A recording of what was played of it before, or the directory of a run whose newest one it is; the match goes on
    from there."""

    @property
    def directory(self) -> Path:
        """Where its recording is."""
        assert self.config.record is not None, "a match in another process is recorded"
        return self.config.record.parent


class Ended(Frozen):
    """How a job ended."""

    state: Literal["done", "error", "timeout", "stopped", "lost"]
    """`done`: its results are in the recording; `lost`: the process that played it died without a word."""
    words: str = ""
    """Why the match is not valid, or what went wrong."""


class MatchWorker:
    """A process that plays matches, one at a time."""

    def __init__(self, process: asyncio.subprocess.Process, log: Path | None) -> None:
        self._process = process
        self._log = log

    @classmethod
    async def start(cls, *options: str, log: Path | None = None) -> Self:
        """Start a process with these options of `khala_sc2.playing.worker`; `log` gets its stderr, ours if it is None."""
        process = await start_process("khala_sc2.playing.worker", *options, environ=os.environ, log=log, piped=True)
        return cls(process, log)

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the process is there."""
        return self._process.returncode is None

    async def play(self, job: Job) -> Ended:
        """Play a match; return when it is over, or the process is gone."""
        assert self._process.stdin is not None and self._process.stdout is not None
        with contextlib.suppress(ConnectionError):  # it is gone, and its last line or its exit code says why
            self._process.stdin.write(job.model_dump_json().encode() + b"\n")
            await self._process.stdin.drain()
        line = await self._process.stdout.readline()
        if line.endswith(b"\n"):
            return Ended.model_validate_json(line)
        code = await self._process.wait()
        how = signal.Signals(-code).name if code < 0 else f"code {code}"
        its_log = "" if self._log is None else f"; {self._log} has its last words"
        return Ended(state="lost", words=f"its process ended with {how}{its_log}")

    def stop(self) -> None:
        """Have the process end in order; `play` returns soon."""
        with contextlib.suppress(ProcessLookupError):
            ask_to_end(self._process)

    async def close(self) -> None:
        """End the process, in order if there is time."""
        await end_process(self._process, END_S)
