"""Processes that have imported all that an agent needs, and wait to be told which one to be.

To import it takes a process a second of a free core, and more on a busy machine; what it then becomes is `khala agent`
with the same arguments and environment as one that is started for the purpose. Each is for one use. `khala run` starts
one before it imports anything itself; a worker of `khala serve` has some in stock. `python -m khala_sc2.playing.spare` is
the process; `Spares` is the stock that its parent keeps.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
import os
import runpy
import sys
from collections import deque
from typing import TYPE_CHECKING, Self

from khala_protocol.parent_watch import end_with_parent
from khala_sc2.playing import environment
from khala_sc2.playing.children import END_S, spawn
from khala_sc2.playing.processes import end_process, redirect, start_process

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path
    from types import TracebackType

NEEDED = ("khala_sc2.cli", "khala_agents.commands", "khala_agents.llm.transport")
"""Modules of the command line, which is above this one, and of what it does for agents."""


class Spares:
    """A stock of processes, as a `khala_sc2.playing.children.Spawn`; leaving the context ends those that nobody took."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._stock: deque[asyncio.subprocess.Process] = deque()

    async def __aenter__(self) -> Self:
        """Start the processes; they are of use before they are ready."""
        for _ in range(self._count):
            process = await start_process("khala_sc2.playing.spare", environ=environment.plain(), piped=True)
            self._stock.append(process)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await asyncio.gather(*(end_process(process, END_S) for process in self._stock))

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
    os.environ.update(job["environ"])
    redirect(0, os.devnull, os.O_RDONLY)
    redirect(1, os.devnull, os.O_WRONLY)
    redirect(2, job["log"], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    sys.argv = ["khala", *job["arguments"]]
    runpy.run_module("khala_sc2", run_name="__main__")


if __name__ == "__main__":
    main()
