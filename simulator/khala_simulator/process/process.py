"""The state of one game process between requests: its build, its saved maps, its game.

Above: the handlers of requests. Below: `game.py`.
"""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import TYPE_CHECKING

from khala_simulator.tables.versions import DEFAULT_VERSION, VERSION_OF_BUILD

if TYPE_CHECKING:
    from google.protobuf.message import Message
    from s2clientprotocol import sc2api_pb2 as sc

    from khala_simulator.api.game import HostedGame, Setup
    from khala_simulator.api.game_info import GameInfo
    from khala_simulator.api.seat import PlayerSeat
    from khala_simulator.process.clock import RealtimeClock
    from khala_simulator.process.lan import Peers

_PATCH_OF_BUILD = {75689: "4.10.0", 92440: "5.0.13"}
_DATA_OF_BUILD = {75689: "B89B5D6FA7CBF6452E721311BFBC6CB2"}


class Failure(Exception):
    """A legal request that fails: the answer is its own body with its own error, and nothing changes."""

    def __init__(self, body: Message) -> None:
        super().__init__(body)
        self.body = body


@dataclasses.dataclass(frozen=True)
class Party:
    """The members of a game at its start, as one of them sees it."""

    setup: Setup
    interfaces: dict[int, sc.InterfaceOptions]  # of the participants
    me: int  # number of the client's own place
    watched: int | None  # the player that it observes, 0 all of them; None if it plays
    options: sc.InterfaceOptions  # its own


@dataclasses.dataclass
class Playing:
    """A game with the seat of the client that is connected to this process."""

    game: HostedGame
    seat: PlayerSeat
    info: GameInfo
    replay: bool = False
    clock: RealtimeClock | None = None  # of a game in real time
    party: Party | None = None  # with which the game began, if it is no replay
    peers: Peers | None = None  # the other processes of the game
    episode: int = 0  # restarts of the same game before this one
    bookmark: Playing | None = None  # the game as it was at the last quick save


class Process:
    """The state of one game process."""

    def __init__(self, data_dir: str | Path, base_build: int, data_version: str | None) -> None:
        self.data_dir = Path(data_dir)
        self.base_build = base_build
        self.game_version = f"{_PATCH_OF_BUILD.get(base_build, '0.0.0')}.{base_build}"
        self.data_version = data_version or _DATA_OF_BUILD.get(base_build, "")
        self.tables = VERSION_OF_BUILD.get(base_build, DEFAULT_VERSION)
        self.maps: dict[str, bytes] = {}  # saved by the client, under its path
        self.setup: Setup | None = None  # of the game that is created and not yet joined
        self.playing: Playing | None = None

    @property
    def about(self) -> dict[str, str]:
        """The version, in the form of the game's own replays."""
        return {
            "GameVersion": self.game_version,
            "DataBuild": str(self.base_build),
            "DataVersion": self.data_version,
            "BaseBuild": f"Base{self.base_build}",
        }

    def play(self, playing: Playing | None) -> None:
        """Turn to another game, or to none; leave the other processes of the one before."""
        before, self.playing = self.playing, playing
        if before is not None and before.peers is not None:
            before.peers.close()

    @property
    def over(self) -> bool:
        """Whether the game that is played or watched has come to its end."""
        return self.playing is not None and self.playing.game.over

    @property
    def table(self) -> Playing:
        """The game that is played or watched, at the present; the state machine refuses requests without one."""
        if self.playing is None:
            raise RuntimeError("no game is being played")
        if self.playing.clock is not None:
            self.playing.clock.catch_up()
        return self.playing

    @staticmethod
    def fresh_seed() -> int:
        """Return a seed for a game that was created without one."""
        return int.from_bytes(os.urandom(4), "little")
