"""How fast the game goes on: as fast as it can, or as fast as a wall clock.

`khala_orchestrator.match.match` waits for its pace before each step. With the clock `realtime` a step of n game loops
takes n / (22.4 * speed) seconds. A step that took longer is not made up for, since the game must not run faster than
its speed: the time lost is the lag.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Protocol

from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from khala_protocol.messages import Clock


class Pacing(Protocol):
    """When the game may go on."""

    def begin(self) -> None:
        """Begin an episode."""

    async def until(self, loop: int) -> float:
        """Wait until it is time for a game loop; return the seconds that the game is behind."""


class AtOnce:
    """A game that goes on as soon as all is said, as in replays and with clocks that wait for the agents."""

    def begin(self) -> None:
        """Do nothing."""

    async def until(self, loop: int) -> float:  # noqa: ARG002  # there is nothing to wait for
        """Return at once."""
        return 0.0


class WallClock:
    """A game that goes on with the wall clock."""

    def __init__(self, speed: float) -> None:
        self._loops_per_s = LOOPS_PER_S * speed
        self._before: tuple[int, float] | None = None
        """The game loop that was last waited for, and when it was due."""
        self._lag_s = 0.0

    def begin(self) -> None:
        """Start the clock with the next step."""
        self._before = None
        self._lag_s = 0.0

    async def until(self, loop: int) -> float:
        """Wait until it is time for a game loop; return the seconds lost since the beginning."""
        now = asyncio.get_running_loop().time
        earlier, at_s = self._before or (loop, now())
        due_s = at_s + (loop - earlier) / self._loops_per_s
        if (ahead_s := due_s - now()) > 0:
            await asyncio.sleep(ahead_s)
        else:
            self._lag_s -= ahead_s
            due_s = now()
        self._before = loop, due_s
        return self._lag_s


def pacing_of(clock: Clock) -> Pacing:
    """Return the pacing that a clock asks for."""
    return WallClock(clock.speed) if clock.rule == "realtime" else AtOnce()
