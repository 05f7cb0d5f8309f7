"""Keeps a first word from being lost: a publisher of Zenoh is silent until it has heard of a subscriber.

News of a subscriber takes a moment (0.2 to 0.8 ms were measured) from the router to a publisher; what is put meanwhile
goes nowhere, up to 60 of 60 times. A publisher that knows of nobody waits that long, once.
"""

from __future__ import annotations

import asyncio

WAIT_S = 0.02


class Audience:
    """Whether anybody is known to listen to one publisher; everything here runs on the loop."""

    def __init__(self, *, present: bool = False) -> None:
        self._present = asyncio.Event()
        self._waited = False
        self.see(present=present)

    def see(self, *, present: bool) -> None:
        """Somebody listens now, or nobody any more."""
        if present:
            self._present.set()
        else:
            self._present.clear()
        self._waited = False

    async def wait(self) -> None:
        """Returns when somebody listens; at once if nobody came the last time."""
        if self._present.is_set() or self._waited:
            return
        try:
            async with asyncio.timeout(WAIT_S):
                await self._present.wait()
        except TimeoutError:
            self._waited = True
