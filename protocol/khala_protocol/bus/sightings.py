"""Turn a session's news of tokens and of its own link into `Liveness`, without blaming others for our link.

A session that loses its link first hears that every token is gone, and only then of the link (0.1 to 0.8 ms later on
an idle machine). So a token's end waits a moment for such news.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING

from khala_protocol.bus import Liveness

if TYPE_CHECKING:
    from khala_protocol.bus.inbox import Inbox

PATIENCE_S = 0.02


class Sightings:
    """The source of one `watch`: it fills a mailbox; everything here runs on the loop.

    Args:
        mailbox: where the reports go.
        patience_s: how long the end of a token waits for the end of our link; 0 where there is no single link.
    """

    def __init__(self, mailbox: Inbox[Liveness], *, patience_s: float = PATIENCE_S, link_up: bool = True) -> None:
        self._mailbox = mailbox
        self._patience_s = patience_s
        self._link_up = link_up
        self._alive: set[str] = set()
        self._held: deque[tuple[str, bool]] = deque()

    def token(self, key: str, *, alive: bool) -> None:
        """Note that a token appeared or went away."""
        if self._link_up and self._patience_s and (self._held or not alive):
            self._held.append((key, alive))
            asyncio.get_running_loop().call_later(self._patience_s, self._release, 1)
        else:
            self._report(key, alive=alive)

    def link(self, *, up: bool) -> None:
        """Note that our link came up or went down."""
        self._link_up = up
        if not up:
            self._release(len(self._held))

    def _release(self, count: int) -> None:
        for _ in range(min(count, len(self._held))):
            key, alive = self._held.popleft()
            self._report(key, alive=alive)

    def _report(self, key: str, *, alive: bool) -> None:
        if alive is (key in self._alive):
            return
        (self._alive.add if alive else self._alive.remove)(key)
        self._mailbox.offer(Liveness(key, alive=alive, link_up=alive or self._link_up))
