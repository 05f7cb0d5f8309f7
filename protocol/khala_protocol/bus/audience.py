"""Keep the first sample from being lost: a publisher of Zenoh sends nothing until it knows of a subscriber.

News of a subscriber takes a moment (0.2 to 0.8 ms were measured) from the router to a publisher; samples put meanwhile
are lost, up to 60 of 60 times. A publisher that knows of no subscriber waits that long, once.
"""

from __future__ import annotations

import asyncio

WAIT_S = 0.02


class Audience:
    """Whether a subscriber of one publisher is known; everything here runs on the loop."""

    def __init__(self, *, present: bool = False) -> None:
        self._present = asyncio.Event()
        self._waited = False
        self.see(present=present)

    def see(self, *, present: bool) -> None:
        """Note that there is a subscriber now, or none any more."""
        if present:
            self._present.set()
        else:
            self._present.clear()
        self._waited = False

    async def wait(self) -> None:
        """Return when there is a subscriber; at once if none came the last time."""
        if self._present.is_set() or self._waited:
            return
        try:
            async with asyncio.timeout(WAIT_S):
                await self._present.wait()
        except TimeoutError:
            self._waited = True
