"""The processes that a match on one machine needs next to its host: started, watched, started again, ended with it.

The output of a child goes to its log file; its last lines are quoted when it ends too early.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from typing import TYPE_CHECKING, Protocol, Self

from khala_protocol.errors import KhalaError
from khala_protocol.files import open_private
from khala_sc2.playing import environment
from khala_sc2.playing.processes import end_process, start_process

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path
    from types import TracebackType

log = logging.getLogger(__name__)

END_S = 3.0
"""Time that a child gets to end after SIGTERM."""
QUOTED_LINES = 3
PAUSES_S = (0.2, 1.0, 5.0)
"""Before each new start of a child that failed; after the last one, a failure is for good."""
STEADY_S = 60.0
"""A child that ran for so long has recovered: its failures are counted from the beginning again."""


class ChildDied(KhalaError):
    """A process that the match needs has ended, or did not start."""


class Spawn(Protocol):
    """How a process is started."""

    async def __call__(
        self, arguments: Sequence[str], environ: Mapping[str, str], log: Path
    ) -> asyncio.subprocess.Process:
        """Return a process that runs `khala <arguments>`, with this environment, and stderr at the end of `log`."""


async def spawn(arguments: Sequence[str], environ: Mapping[str, str], log: Path) -> asyncio.subprocess.Process:
    """Start a new process; see `Spawn`."""
    return await start_process("khala_sc2", *arguments, environ=environ, log=log)


class Children:
    """The child processes of a match. An asynchronous context manager that ends them all."""

    def __init__(self, logs: Path, spawn: Spawn = spawn) -> None:
        self._logs = logs
        self._spawn = spawn
        self._children: dict[str, _Child] = {}

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await asyncio.gather(*(child.end() for child in self._children.values()))

    async def start(self, name: str, *arguments: str, environ: Mapping[str, str] | None = None) -> None:
        """Start `khala <arguments>`.

        Args:
            name: of the child and of its log.
            arguments: of the command.
            environ: its environment; None for one without keys.
        """
        await self._add(name, arguments, environ).start()

    async def keep(self, begun: asyncio.Event) -> None:
        """Start a child again that fails once `begun` is set; return when all have ended without an error.

        Raises:
            ChildDied: one failed before, or again and again.
        """
        await asyncio.gather(*(child.keep(begun) for child in self._children.values()))

    def _add(self, name: str, arguments: tuple[str, ...], environ: Mapping[str, str] | None) -> _Child:
        environ = environment.plain() if environ is None else environ
        child = _Child(name, arguments, environ, self._logs / f"{name}.log", self._spawn)
        self._children[name] = child
        return child


class _Child:
    """One process, and what it takes to start it again."""

    def __init__(
        self, name: str, arguments: tuple[str, ...], environ: Mapping[str, str], log: Path, spawn: Spawn
    ) -> None:
        self.arguments = arguments
        self._spawn = spawn
        self._name = name
        self._environ = environ
        self._log = log
        self._process: asyncio.subprocess.Process | None = None
        self._started_s = 0.0
        self._begins_at = 0
        self._failures = 0

    async def start(self) -> None:
        """Start the process."""
        self._log.touch(0o600)
        self._begins_at = self._log.stat().st_size
        self._started_s = asyncio.get_running_loop().time()
        self._process = await self._spawn(self.arguments, self._environ, self._log)

    async def keep(self, begun: asyncio.Event) -> None:
        """Start the process again when it fails, see `Children.keep`."""
        while self._process and (code := await self._process.wait()):
            failure = f"process {self._name} ended with code {code}{self.quote()}"
            pause_s = self._pause_s()
            if pause_s is None or not begun.is_set():
                raise ChildDied(failure)
            log.warning("%s; it is started again", failure)
            await asyncio.sleep(pause_s)
            self._note(f"started again, {self._failures} of {len(PAUSES_S)} times: it had ended with code {code}")
            await self.start()

    async def end(self) -> None:
        """End the process in order, or kill it."""
        if self._process is not None:
            await end_process(self._process, END_S)

    def quote(self) -> str:
        """Return the last lines that the process wrote, to be appended to what happened."""
        with self._log.open("rb") as log:
            log.seek(self._begins_at)
            lines = (line.decode(errors="replace").strip() for line in log)
            last = deque(filter(None, lines), QUOTED_LINES)
        return f": {' / '.join(last)}" if last else f"; see {self._log}"

    def _pause_s(self) -> float | None:
        """Count a failure; return the pause before the next start, or None if there is none any more."""
        ran_s = asyncio.get_running_loop().time() - self._started_s
        self._failures = 1 if ran_s > STEADY_S else self._failures + 1
        return PAUSES_S[self._failures - 1] if self._failures <= len(PAUSES_S) else None

    def _note(self, text: str) -> None:
        with open_private(self._log, "ab") as log:
            log.write(f"{text}\n".encode())
