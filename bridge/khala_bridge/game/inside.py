"""A game without a process of its own: PySC2 speaks to it by calls in place of a websocket.

Who makes the game says what answers a request; this module knows no simulator. Above: `khala_sc2.playing.inside`.
Beside it: `khala_bridge.game.processes`, whose `Processes` hand such a game out as they do a process.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Self

from khala_bridge.compat import protocol, remote_controller

if TYPE_CHECKING:
    from collections.abc import Callable

NO_PORT = 0


class InsideProcess:
    """What PySC2 takes for a process of the game that it started, and its connection."""

    host = ""
    port = NO_PORT

    def __init__(self, answer: Callable[[bytes], bytes]) -> None:
        """Take what answers a request of the SC2 API, as bytes of its messages; one thread at a time calls it."""
        self._line: _Line | None = _Line(answer)
        self._controller: Any = _Controller(self._line)

    @property
    def controller(self) -> Any:
        """The `RemoteController` that asks the game; None if it has ended."""
        return self._controller

    @property
    def running(self) -> bool:
        """Whether the game still answers."""
        return self._line is not None

    @property
    def _proc(self) -> Self:  # PySC2's name for what `PySC2Game.kill` kills
        return self

    def kill(self) -> None:
        """Answer no more; a request that is being answered ends first."""
        line, self._line = self._line, None
        if line is not None:
            line.close()

    def close(self) -> None:
        """End the game in good order; may be called twice."""
        controller, self._controller = self._controller, None
        if controller is not None:
            with contextlib.suppress(protocol.ConnectionError):  # it was killed
                controller.quit()
            controller.close()
        self.kill()


class _Controller(remote_controller.RemoteController):  # type: ignore[misc]  # PySC2 is untyped
    """PySC2's, on a line in place of a socket."""

    def __init__(self, line: _Line) -> None:
        self._given = line
        super().__init__("", NO_PORT, timeout_seconds=1)

    def _connect(self, *_: Any) -> _Line:
        return self._given


class _Line:
    """Looks to PySC2 like a websocket: an answer waits for each request that was sent."""

    def __init__(self, answer: Callable[[bytes], bytes]) -> None:
        self._answer: Callable[[bytes], bytes] | None = answer
        self._answered = b""

    @property
    def sock(self) -> Self:
        return self

    def getpeername(self) -> tuple[str, int]:
        return "", NO_PORT

    def settimeout(self, limit_s: float | None) -> None:
        """Do nothing: a call has no limit of time."""

    def send(self, request: bytes) -> None:
        answer = self._answer
        if answer is None:
            raise OSError("the game in this process has ended")  # as of a socket that was closed
        self._answered = answer(request)

    def recv(self) -> bytes:
        answered, self._answered = self._answered, b""
        return answered

    def close(self) -> None:
        self._answer = None
