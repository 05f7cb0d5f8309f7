"""Processes that have imported all that an agent needs, and wait to be told which one to be.

To import it takes a process a second of a free core, and more on a busy machine; what it then becomes is `khala agent`
with the same arguments and environment as one that is started for the purpose. Each is for one use. `khala run` starts
one before it imports anything itself; a worker of `khala serve` has some in stock. `python -m khala.playing.spare` is
the process; `Spares` is the stock that its parent keeps.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
import os
import runpy
import subprocess
import sys
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Self

from khala.playing import environment
from khala.playing.children import spawn
from khala_protocol.parent_watch import PARENT, end_with_parent, named_parent

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from types import TracebackType

NEEDED = ("khala.cli", "khala_agents.commands", "khala_agents.llm.transport")
"""Modules of the command line, which is above this one, and of what it does for agents."""


class Spares:
    """A stock of processes, as a `khala.playing.children.Spawn`; leaving the context ends those that nobody took."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._stock: deque[asyncio.subprocess.Process] = deque()

    async def __aenter__(self) -> Self:
        """Start the processes; they are of use before they are ready."""
        for _ in range(self._count):
            self._stock.append(await _start())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        while self._stock:
            process = self._stock.popleft()
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()

    async def ready(self) -> None:
        """Wait until all have imported what they need."""
        for process in self._stock:
            assert process.stdout is not None
            await process.stdout.readline()

    async def __call__(
        self, arguments: Sequence[str], environ: Mapping[str, str], log: Path
    ) -> asyncio.subprocess.Process:
        """Turn a process of the stock into `khala <arguments>`; start one if there is none."""
        while self._stock:
            process = self._stock.popleft()
            job = {"arguments": arguments, "environ": dict(environ), "log": str(log)}
            with contextlib.suppress(ConnectionError):
                assert process.stdin is not None
                process.stdin.write(json.dumps(job).encode() + b"\n")
                await process.stdin.drain()
                process.stdin.close()
                return process
        return await spawn(arguments, environ, log)


async def _start() -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        sys.executable,
        "-P",  # with no module of the current directory on its path
        "-m",
        "khala.playing.spare",
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**environment.plain(), **named_parent()},
        start_new_session=True,
    )


def main() -> None:
    """Import everything, wait for a job on stdin, and do it."""
    end_with_parent()
    for module in NEEDED:
        importlib.import_module(module)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    line = sys.stdin.readline()
    if not line:
        return
    job = json.loads(line)
    os.environ.clear()
    os.environ.update({name: value for name, value in job["environ"].items() if name != PARENT})
    _redirect(Path(job["log"]))
    sys.argv = ["khala", *job["arguments"]]
    runpy.run_module("khala", run_name="__main__")


def _redirect(log: Path) -> None:
    nothing = Path(os.devnull)
    ends = ((nothing, os.O_RDONLY, 0), (nothing, os.O_WRONLY, 1), (log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 2))
    for path, flags, number in ends:
        opened = os.open(path, flags, 0o600)
        os.dup2(opened, number)
        os.close(opened)


if __name__ == "__main__":
    main()
