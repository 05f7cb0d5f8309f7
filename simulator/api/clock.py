"""Real time: how far a game that nobody steps has run by the clock on the wall.

The game is advanced when the client asks for something, by as many loops as have passed since; so nothing runs in
the background, and a log of such a game replays like any other.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from simulator.api.game import Game

LOOPS_PER_SECOND = 22.4


class Clock:
    """Keeps one game at 22.4 loops per second."""

    def __init__(
        self,
        game: Game,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._game, self._now, self._sleep = game, now, sleep
        self._start_s = now()

    def catch_up(self) -> None:
        """Advances the game to the present."""
        due = int((self._now() - self._start_s) * LOOPS_PER_SECOND)
        if due > self._game.world.loop:
            self._game.step(due - self._game.world.loop)

    def wait_for(self, loop: int) -> None:
        """Returns when the game has reached a loop, or its end."""
        self.catch_up()
        while self._game.world.loop < loop and not self._game.over:
            ahead_s = self._start_s + loop / LOOPS_PER_SECOND - self._now()
            self._sleep(max(ahead_s, 0.001))
            self.catch_up()
