"""Which request is legal in which state, as a table.

The states and the numbers are those of the SC2 API's `Status`. A missing entry of `LEGAL` *is* the usage error; nothing
else in the simulator reads the state. The machine has no I/O: above it is `session.py`, which feeds it one request
after another; below it is nothing.
"""

from __future__ import annotations

import enum


class Status(enum.IntEnum):
    """State of one game process, with the API's numbers."""

    launched = 1
    init_game = 2
    in_game = 3
    in_replay = 4
    ended = 5
    quit = 6


class UsageError(Exception):
    """The client's fault: a request that makes no sense in this state, or no sense at all.

    It becomes `Response.error` without a typed body, and never changes the state.
    """


# Clients take this very sentence for the end of a game, not for a fault: PySC2 as a part of the error, python-sc2
# as the whole of it.
GAME_OVER = "Game has already ended"

_ALWAYS = frozenset({"ping", "quit", "replay_info"})
_LOBBY = _ALWAYS | {
    "create_game", "start_replay", "available_maps", "save_map",
    "join_lan",  # a guest joins the game that another process hosts
}  # fmt: skip
_WATCH = _ALWAYS | {"game_info", "data", "observation", "create_game", "start_replay"}
_PLAY = _WATCH | {
    "step", "action", "obs_action", "debug", "query", "save_replay", "leave_game", "restart_game",
    "quick_save", "quick_load", "map_command",
}  # fmt: skip

LEGAL: dict[Status, frozenset[str]] = {
    Status.launched: _LOBBY,
    Status.init_game: _LOBBY | {"join_game"},
    Status.in_game: _PLAY,
    Status.in_replay: _WATCH | {"step", "obs_action", "query", "leave_game"},
    Status.ended: _WATCH | {"save_replay", "restart_game", "leave_game", "quick_load"},
    Status.quit: frozenset(),
}

AFTER: dict[str, Status] = {
    "create_game": Status.init_game,
    "join_game": Status.in_game,
    "join_lan": Status.in_game,
    "restart_game": Status.in_game,
    "quick_load": Status.in_game,
    "start_replay": Status.in_replay,
    "leave_game": Status.launched,
    "quit": Status.quit,
}
"""State after a request that succeeded; requests that are not listed leave it. A game that is decided turns
`in_game` and `in_replay` into `ended` (`Machine.end`)."""

_OVER = frozenset({"step", "action", "query", "debug"})


class Machine:
    """The state of one process and its legal moves."""

    def __init__(self) -> None:
        self.status = Status.launched

    def check(self, kind: str) -> None:
        """Refuse a request of this kind, if it is not legal now.

        Raises:
            UsageError: with the sentence for the client.
        """
        if kind in LEGAL[self.status]:
            return
        if self.status is Status.ended and kind in _OVER:
            raise UsageError(GAME_OVER)
        states = ", ".join(status.name for status, kinds in LEGAL.items() if kind in kinds)
        if not states:
            raise UsageError(f"Unknown request: {kind}")
        raise UsageError(f"{kind} is not possible in state {self.status.name}, only in: {states}")

    def move_on(self, kind: str) -> None:
        """Move to the state that follows a successful request of this kind."""
        self.status = AFTER.get(kind, self.status)

    def end(self) -> None:
        """Note that the game that is played or watched is over."""
        if self.status in {Status.in_game, Status.in_replay}:
            self.status = Status.ended
