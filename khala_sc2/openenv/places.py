"""The places of a server: how many sessions play at a time, and which of them makes room for another. No I/O.

A session takes a place when its first episode begins, and not when its client connects. Above:
`khala_sc2.openenv.environment`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, Protocol

from openenv.core.env_server.exceptions import SessionCapacityError

if TYPE_CHECKING:
    from collections.abc import Callable

YIELD_S: Final = 900.0
"""A session in the middle of an episode makes room after this long without a call: trainers think for minutes."""
OVER_YIELD_S: Final = 60.0
"""A session whose episode is over makes room after this long; nothing of it is lost."""


class PlaceHolder(Protocol):
    """A session that may hold a place."""

    @property
    def is_busy(self) -> bool:
        """Whether it is answering a call."""

    @property
    def is_over(self) -> bool:
        """Whether its episode is over."""

    async def give_up(self, why: str) -> None:
        """End the match, and tell the client why with its next call."""


@dataclass(slots=True)
class ServerPlaces:
    """The places of one server.

    Attributes:
        most: that there are.
        clock: monotonic seconds.
    """

    most: int
    clock: Callable[[], float] = time.monotonic
    _last_s: dict[PlaceHolder, float] = field(default_factory=dict)
    """By session with a place: when it did something last."""

    async def take(self, player: PlaceHolder) -> None:
        """Give a session a place, if it has none; the session that has been idle for longest may lose its own.

        Raises:
            SessionCapacityError: all places are taken, and their sessions play.
        """
        loser = None
        if player not in self._last_s and len(self._last_s) >= self.most:
            if (loser := self._idle()) is None:
                raise SessionCapacityError(
                    len(self._last_s),
                    self.most,
                    f"Server at capacity: {len(self._last_s)}/{self.most} sessions play, and none of them has been "
                    f"idle for {YIELD_S / 60:.0f} minutes: try again later, or serve more with --sessions",
                )
            del self._last_s[loser]
        self._last_s[player] = self.clock()
        if loser is not None:
            await loser.give_up(
                "it did nothing for long, and another client needed its place: call reset to begin anew"
            )

    def touch(self, player: PlaceHolder) -> None:
        """Note that a session does something."""
        if player in self._last_s:
            self._last_s[player] = self.clock()

    def free(self, player: PlaceHolder) -> None:
        """Take the place of a session back."""
        self._last_s.pop(player, None)

    def holds(self, player: PlaceHolder) -> bool:
        """Return whether a session has a place."""
        return player in self._last_s

    def _idle(self) -> PlaceHolder | None:
        """Return the session that makes room: rather one whose episode is over, and of those the longest idle."""
        now_s = self.clock()
        idle = [
            (not player.is_over, last_s, number, player)
            for number, (player, last_s) in enumerate(self._last_s.items())
            if not player.is_busy and now_s - last_s >= (OVER_YIELD_S if player.is_over else YIELD_S)
        ]
        return min(idle)[-1] if idle else None
