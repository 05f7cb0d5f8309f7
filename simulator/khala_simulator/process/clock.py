"""Real time: how far a game without steps has run by the wall clock.

A game of one process advances when its client sends a request, by as many loops as have passed since; so nothing runs
in the background, and a log of such a game replays like any other. A game over several processes can't wait for
requests, so `lan.py` advances it.
"""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from khala_simulator.api.game import HostedGame

LOOPS_PER_SECOND = 22.4
_POLL_S = 0.002


class RealtimeClock:
    """Keeps one game at 22.4 loops per second."""

    def __init__(
        self,
        game: HostedGame,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], Awaitable[None]] = asyncio.sleep,
    ) -> None:
        self._game, self._now, self._sleep = game, now, sleep
        self.go_on()

    def go_on(self) -> None:
        """Restart the time from the game's present loop."""
        self._start_s = self._now() - self._game.world.loop / LOOPS_PER_SECOND

    @property
    def due(self) -> int:
        """The loop at which the game should be now."""
        return int((self._now() - self._start_s) * LOOPS_PER_SECOND)

    def catch_up(self) -> None:
        """Advance the game to the present."""
        if self.due > self._game.world.loop:
            self._game.step(self.due - self._game.world.loop)

    async def wait_for(self, loop: int) -> None:
        """Wait until the game has reached a loop, or its end."""
        self.catch_up()
        while self._game.world.loop < loop and not self._game.over:
            await self.sleep_until(loop)
            self.catch_up()

    async def sleep_until(self, loop: int) -> None:
        """Wait until a loop is due."""
        ahead_s = self._start_s + loop / LOOPS_PER_SECOND - self._now()
        await self._sleep(max(ahead_s, _POLL_S))


class SharedClock(RealtimeClock):
    """Keeps the time of a game that advances together with other processes."""

    def catch_up(self) -> None:
        """Do nothing: the game is as far as all processes allow."""
