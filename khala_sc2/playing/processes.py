"""Processes of Khala's own code: how each of them is started, and ended.

Each leads a session or group of its own, so that Ctrl-C reaches the parent alone, which ends the others in order; if
the parent is killed, they end by themselves (`khala_protocol.parent_watch`).
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import subprocess
import sys
from typing import TYPE_CHECKING

from khala_protocol.files import open_private
from khala_protocol.parent_watch import named_parent
from khala_protocol.platforms import apart, ask_to_end

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

LONGEST_LINE = 2**24
"""Bytes of a line that a process and its parent may send each other: a job has a whole task in it."""


async def start_process(
    module: str, *arguments: str, environ: Mapping[str, str], log: Path | None = None, piped: bool = False
) -> asyncio.subprocess.Process:
    """Start `python -m <module> <arguments>`.

    Args:
        module: of the process.
        arguments: of its command line.
        environ: its environment, to which the name of its parent is added.
        log: where its stderr is appended; None for ours.
        piped: whether its stdin and its stdout are pipes to us; they lead nowhere otherwise.
    """
    ends = subprocess.PIPE if piped else subprocess.DEVNULL
    with contextlib.nullcontext() if log is None else open_private(log, "ab") as stderr:
        return await asyncio.create_subprocess_exec(
            sys.executable,
            "-P",  # with no module of the current directory on its path
            "-m",
            module,
            *arguments,
            stdin=ends,
            stdout=ends,
            stderr=stderr,
            env={**environ, **named_parent()},
            limit=LONGEST_LINE,
            **apart(),
        )


def redirect(number: int, path: Path | str, flags: int) -> None:
    """Have a number of this process, such as that of stdout, lead to a file."""
    opened = os.open(path, flags, 0o600)
    os.dup2(opened, number)
    os.close(opened)


async def end_process(process: asyncio.subprocess.Process, within_s: float) -> None:
    """End a process in order, or kill it after `within_s`; its own processes watch it, and end with it."""
    with contextlib.suppress(ProcessLookupError):
        ask_to_end(process)
    try:
        async with asyncio.timeout(within_s):
            await process.wait()
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
