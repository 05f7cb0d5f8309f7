"""Real time: how far a game that nobody steps has run by the clock on the wall.

A game of one process is advanced when its client asks for something, by as many loops as have passed since; so nothing
runs in the background, and a log of such a game replays like any other. Where several processes play one game, none may
wait for its client to ask, and `lan.py` advances it.
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
        """Lets the time go on from where the game is now."""
        self._start_s = self._now() - self._game.world.loop / LOOPS_PER_SECOND

    @property
    def due(self) -> int:
        """The loop at which the game should be now."""
        return int((self._now() - self._start_s) * LOOPS_PER_SECOND)

    def catch_up(self) -> None:
        """Advances the game to the present."""
        if self.due > self._game.world.loop:
            self._game.step(self.due - self._game.world.loop)

    async def wait_for(self, loop: int) -> None:
        """Returns when the game has reached a loop, or its end."""
        self.catch_up()
        while self._game.world.loop < loop and not self._game.over:
            await self.sleep_until(loop)
            self.catch_up()

    async def sleep_until(self, loop: int) -> None:
        """Returns when a loop is due."""
        ahead_s = self._start_s + loop / LOOPS_PER_SECOND - self._now()
        await self._sleep(max(ahead_s, _POLL_S))


class SharedClock(RealtimeClock):
    """Tells the time of a game that is advanced together with other processes."""

    def catch_up(self) -> None:
        """Does nothing: the game is as far as all of them let it go."""
