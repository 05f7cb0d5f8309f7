"""The processes that a match on one machine needs next to its host: started, watched, and ended with it.

Each child leads its own session, so that Ctrl-C reaches the host alone, which ends the others in order. The output of
a child goes to its log file; its last lines are quoted when it ends too early.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
from collections import deque
from typing import TYPE_CHECKING, Any, Self

from khala_protocol.errors import KhalaError

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

END_S = 3.0
"""Time that a child gets to end after SIGTERM."""
QUOTED_LINES = 3


class ChildDied(KhalaError):
    """A process that the match needs has ended, or did not start."""


class Children:
    """The child processes of a match. An asynchronous context manager that ends them all."""

    def __init__(self, logs: Path) -> None:
        self._logs = logs
        self._processes: dict[str, asyncio.subprocess.Process] = {}

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._processes.values():
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGTERM)
        await asyncio.gather(*(_ended(process) for process in self._processes.values()))

    async def start(self, name: str, *arguments: str) -> None:
        """Start `khala <arguments>`; `name` is that of its log."""
        await self._start(name, arguments, subprocess.DEVNULL)

    async def start_ready(self, name: str, *arguments: str, within_s: float = 30.0) -> Any:
        """Start `khala <arguments>`, and return its first line on stdout, read as JSON.

        Raises:
            ChildDied: it ended, or printed nothing in time.
        """
        process = await self._start(name, arguments, subprocess.PIPE)
        assert process.stdout is not None
        try:
            async with asyncio.timeout(within_s):
                line = await process.stdout.readline()
        except TimeoutError:
            raise ChildDied(f"`khala {arguments[0]}` was not ready within {within_s:g} s{self._quote(name)}") from None
        if not line:
            raise ChildDied(f"`khala {arguments[0]}` did not start{self._quote(name)}")
        return json.loads(line)

    async def first_failure(self) -> ChildDied:
        """Wait until a child ends with an error, and return that error; wait for ever if none does."""
        failed: asyncio.Future[ChildDied] = asyncio.get_running_loop().create_future()

        async def follow(name: str, process: asyncio.subprocess.Process) -> None:
            if (code := await process.wait()) and not failed.done():
                failed.set_result(ChildDied(f"process {name} ended with code {code}{self._quote(name)}"))

        follows = [asyncio.create_task(follow(name, process)) for name, process in self._processes.items()]
        try:
            return await failed
        finally:
            for task in follows:
                task.cancel()

    async def _start(self, name: str, arguments: tuple[str, ...], stdout: int) -> asyncio.subprocess.Process:
        with self._log(name).open("ab") as log:
            process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                "khala",
                *arguments,
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=log,
                # The link to a child stays on this machine, and needs no certificate.
                env={name: value for name, value in os.environ.items() if name != "KHALA_TLS"},
                start_new_session=True,
            )
        self._processes[name] = process
        return process

    def _log(self, name: str) -> Path:
        return self._logs / f"{name}.log"

    def _quote(self, name: str) -> str:
        with self._log(name).open(encoding="utf-8", errors="replace") as log:
            last = deque((line.strip() for line in log if line.strip()), QUOTED_LINES)
        return f": {' / '.join(last)}" if last else f"; see {self._log(name)}"


async def _ended(process: asyncio.subprocess.Process) -> None:
    try:
        async with asyncio.timeout(END_S):
            await process.wait()
    except TimeoutError:
        process.kill()
        await process.wait()
