"""Who plays a seat: one client at a time, so that no other acts for it unnoticed. A machine without input or output.

Above: `khala_sc2.mcp.server`. Clients of older protocol versions have sessions, whose identifier names them. Newer versions
have none; there the cookie that `khala_sc2.mcp.serve` gives each client names it. All clients without cookies are one.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from khala_protocol.errors import KhalaError

if TYPE_CHECKING:
    from collections.abc import Callable

HELD_S: Final = 30.0
"""A client keeps its seat for this long after it did something: longer than a tool takes. Then another one may come."""


class Taken(KhalaError):
    """Another client plays the seat."""


@dataclass(slots=True)
class Holder:
    """The client that plays a seat.

    Attributes:
        seat: its name, for the sentences.
        clock: monotonic seconds.
    """

    seat: str
    clock: Callable[[], float] = time.monotonic
    _client: str | None = None
    _last_s: float = 0.0
    _displaced: frozenset[str] = frozenset()
    """Clients that lost the seat, and have not been told."""
    _briefed: bool = False

    def take(self, client: str) -> None:
        """Let a client play.

        Raises:
            Taken: another one plays, or took the seat over.
        """
        now_s = self.clock()
        if client in self._displaced:
            self._displaced -= {client}
            raise Taken(f"another client has taken {self.seat} over, since you did nothing for {HELD_S:.0f} s")
        if self._client not in {None, client}:
            if now_s - self._last_s < HELD_S:
                raise Taken(
                    f"another client plays {self.seat}: end it, or come back when it has done nothing for "
                    f"{HELD_S:.0f} s"
                )
            assert self._client is not None
            self._displaced |= {self._client}
        if client != self._client:
            self._briefed = False
        self._client, self._last_s = client, now_s

    def leave(self, client: str) -> None:
        """Free the seat when its client ends its session."""
        if client == self._client:
            self._client = None
            self._briefed = False

    def greet(self) -> None:
        """Brief again: a client has connected that may have no name of its own."""
        self._briefed = False

    def brief(self) -> bool:
        """Return whether the client is to be briefed now, and count it as briefed."""
        new, self._briefed = not self._briefed, True
        return new
