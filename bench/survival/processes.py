"""Processes of a measurement: `khala` commands that are started, stopped, killed, and looked for afterwards.

Each is found again by its environment, in `/proc`, and so are the processes that it started: Linux only. Above it:
`bench.survival.resume`, `bench.survival.faults`, `bench.survival.soak`.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import random
import signal
import socket
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Self

from bench.survival.orphans import processes_of

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

END_S = 10.0
LISTENING_S = 60.0
LOOK_S = 0.02


class Processes:
    """The processes of one measurement; a context manager that ends them all.

    Attributes:
        orphans: how many were left some seconds after the end; known when the context is left.
    """

    def __init__(self, directory: Path) -> None:
        """Take an empty directory, for logs and for the temporary files of the processes."""
        self.directory = directory
        self.orphans = 0
        self._mark = f"TMPDIR={directory}"
        self._started: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._started:
            self.end(process)
        until = time.monotonic() + END_S
        while processes_of(self._mark) and time.monotonic() < until:
            time.sleep(LOOK_S)
        left = processes_of(self._mark)
        self.orphans = len(left)
        for pid in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def start(self, log: str, *arguments: str) -> subprocess.Popen[bytes]:
        """Start `khala <arguments>`; what it writes is appended to a log."""
        environ = os.environ | {"TMPDIR": str(self.directory)}
        with (self.directory / f"{log}.log").open("ab") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", "khala_sc2", *arguments],
                stdin=subprocess.DEVNULL, stdout=output, stderr=output, env=environ,
            )  # fmt: skip
        self._started.append(process)
        return process

    def end(self, process: subprocess.Popen[bytes]) -> None:
        """End a process in order, or kill it."""
        if process.poll() is None:
            process.send_signal(signal.SIGCONT)
            process.terminate()
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def last_words(self, log: str) -> str:
        """Return the end of a log."""
        return (self.directory / f"{log}.log").read_text(errors="replace")[-2000:]

    def strangers(self) -> set[int]:
        """Return the processes that were started by those started here, such as games."""
        return processes_of(self._mark) - {process.pid for process in self._started}


def free_port() -> int:
    """Return a port that nobody listens on now.

    It is below 32768, from where on Linux takes the ports of outgoing connections: while a killed listener is away, one
    of those could take its port.
    """
    while True:
        port = random.randrange(20_000, 32_768)
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


async def until_listening(port: int) -> None:
    """Return when somebody listens there.

    Raises:
        TimeoutError: nobody does within `LISTENING_S`.
    """
    async with asyncio.timeout(LISTENING_S):
        while True:
            with contextlib.suppress(OSError):
                _, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.transport.abort()
                return
            await asyncio.sleep(0.005)
