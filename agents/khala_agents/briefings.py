"""The newest briefing, and waiting for the right one. Only `khala_agents.worker` uses it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala_protocol.messages import Briefing

GRACE_S = 0.25
"""Briefing and observation of a new episode travel on different topics: the briefing may arrive a moment later."""


class Briefings:
    """The newest briefing of one agent."""

    def __init__(self) -> None:
        self._newest: Briefing | None = None
        self._changed = asyncio.Condition()

    @property
    def newest(self) -> Briefing | None:
        """The newest one; None before the first."""
        return self._newest

    async def put(self, briefing: Briefing) -> bool:
        """Store a briefing; return False if it says nothing new."""
        if briefing == self._newest:
            return False
        async with self._changed:
            self._newest = briefing
            self._changed.notify_all()
        return True

    async def of(self, episode: int) -> Briefing:
        """Return the briefing of an episode, or the newest one if that does not arrive in a moment."""
        if self._newest is None or self._newest.episode != episode:
            async with self._changed:
                try:
                    async with asyncio.timeout(GRACE_S):
                        await self._changed.wait_for(lambda: getattr(self._newest, "episode", None) == episode)
                except TimeoutError:
                    await self._changed.wait_for(lambda: self._newest is not None)
        assert self._newest is not None
        return self._newest
