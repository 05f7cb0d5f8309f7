"""Replays: the setup of a game and its log, to be simulated again.

The format is the simulator's own: a line that marks it, one line of JSON with the setup, then for each entry of the log
its loop, player and kind with the bytes of the message, all of it compressed. A user's own map is included. In a file
it is the member of an archive like the game's, because clients look there for the version of the game.

Above: `viewing.py`, `lockstep.py`. Below: `game.py`.
"""

from __future__ import annotations

import dataclasses
import json
import struct
import zlib
from typing import TYPE_CHECKING, Annotated

from google.protobuf.message import DecodeError, Message
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from s2clientprotocol import debug_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.game import HostedGame, LogEntry, Setup
from khala_simulator.api.projection import size_problem
from khala_simulator.maps.map_file import read_map
from khala_simulator.process import mpq
from khala_simulator.process.clock import LOOPS_PER_SECOND

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

METADATA = "replay.gamemetadata.json"
"""The member of a replay file in which clients look for the version."""

_MEMBER = "khala.replay"
_MARK = b"Khala replay 3\n"
_ENTRY = struct.Struct("<IBBI")  # loop, player, kind, size
_KINDS: tuple[type[sc.Action | debug_pb2.DebugCommand], ...] = (sc.Action, debug_pb2.DebugCommand)
_LARGEST = 2**29
"""Bytes of the content of a replay."""


class ReplayError(ValueError):
    """The bytes are no replay of this simulator."""


@dataclasses.dataclass(frozen=True)
class Replay:
    """What is in a replay file."""

    setup: Setup
    interfaces: dict[int, sc.InterfaceOptions]  # with which the players clicked
    loops: int
    results: dict[int, int]
    races: dict[int, str]
    log: tuple[LogEntry, ...]

    def file(self, version: dict[str, str]) -> bytes:
        """Return the file; `version` is its description of the game, in the form of the game's own files."""
        title = self.setup.game_map.name
        duration_s = int(self.loops / LOOPS_PER_SECOND)
        players = [{"PlayerID": player} for player in self.results]
        about = {"Title": title, **version, "Duration": duration_s, "Players": players}
        return mpq.pack({METADATA: json.dumps(about).encode(), _MEMBER: self.encode()})

    def encode(self) -> bytes:
        """Return the replay without the archive around it."""
        setup = self.setup
        head = {
            "path": setup.path,
            "map": setup.map_data.decode("latin-1"),
            "players": [_hex(player) for player in setup.players],
            "interfaces": {player: _hex(options) for player, options in self.interfaces.items()},
            "seed": setup.seed,
            "disable_fog": setup.disable_fog,
            "realtime": setup.realtime,
            "observers": [_hex(observer) for observer in setup.observers],
            "loops": self.loops,
            "results": self.results,
            "races": self.races,
        }
        return _MARK + zlib.compress(json.dumps(head).encode() + b"\n" + pack(self.log))

    @classmethod
    def decode(cls, data: bytes) -> Replay:
        """Return the replay in the bytes of a file, with or without its archive; raise ReplayError if there is none."""
        if data.startswith(mpq.MAGIC):
            try:
                data = mpq.member(data, _MEMBER) or b""
            except mpq.MpqError as error:
                raise ReplayError(f"The replay is damaged: {error}") from error
        if not data.startswith(_MARK):
            raise ReplayError("The data is not a replay of this simulator")
        try:
            return cls._decode(_unpack(data[len(_MARK) :]))
        except (zlib.error, ValueError, LookupError, struct.error, DecodeError) as error:
            raise ReplayError(f"The replay is damaged: {error}") from error

    @classmethod
    def _decode(cls, data: bytes) -> Replay:
        text, _, log = data.partition(b"\n")
        head = _head(text)
        map_data = head.map.encode("latin-1")
        setup = Setup(
            game_map=read_map(map_data, head.path),
            map_data=map_data,
            path=head.path,
            players=tuple(sc.PlayerSetup.FromString(bytes.fromhex(player)) for player in head.players),
            seed=head.seed,
            disable_fog=head.disable_fog,
            realtime=head.realtime,
            observers=tuple(sc.PlayerSetup.FromString(bytes.fromhex(observer)) for observer in head.observers),
        )
        interfaces = {
            player: sc.InterfaceOptions.FromString(bytes.fromhex(options))
            for player, options in head.interfaces.items()
        }
        if strangers := {*interfaces, *head.results, *head.races}.difference(range(1, len(setup.players) + 1)):
            raise ValueError(f"it has no player {min(strangers)}")
        if problem := next(filter(None, map(size_problem, interfaces.values())), ""):
            raise ValueError(problem)
        return cls(setup, interfaces, head.loops, head.results, head.races, tuple(unpack(log)))


def _unpack(data: bytes) -> bytes:
    whole = zlib.decompressobj()
    content = whole.decompress(data, _LARGEST)
    if not whole.eof:
        raise ValueError("it is cut off, or too large")
    return content


class _Head(BaseModel):
    """What a replay says before its log; messages are in hexadecimal digits."""

    model_config = ConfigDict(strict=True)

    path: str
    map: str
    players: list[str]
    interfaces: dict[int, str]
    seed: Annotated[int, Field(ge=0, lt=2**32)]
    disable_fog: bool
    realtime: bool
    observers: list[str]
    loops: Annotated[int, Field(ge=0, lt=2**32)]
    results: dict[int, Annotated[int, Field(ge=1, le=4)]]
    races: dict[int, str]


def _head(text: bytes) -> _Head:
    try:
        return _Head.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise ValueError(f"{'.'.join(map(str, first['loc'])) or 'head'}: {first['msg']}") from error


def _hex(message: Message) -> str:
    return message.SerializeToString(deterministic=True).hex()


def pack(log: Iterable[LogEntry]) -> bytes:
    """Return entries of a log as bytes."""
    parts = []
    for entry in log:
        data = entry.act.SerializeToString(deterministic=True)
        parts += [_ENTRY.pack(entry.loop, entry.player, _KINDS.index(type(entry.act)), len(data)), data]
    return b"".join(parts)


def unpack(log: bytes) -> Iterator[LogEntry]:
    """Yield the entries in bytes that `pack` made.

    Raises:
        struct.error, LookupError, DecodeError: the bytes are invalid.
    """
    at = 0
    while at < len(log):
        loop, player, kind, size = _ENTRY.unpack_from(log, at)
        at += _ENTRY.size
        yield LogEntry(loop, player, _KINDS[kind].FromString(log[at : at + size]))
        at += size


def record(game: HostedGame) -> Replay:
    """Return the replay of a game up to now."""
    players = range(1, len(game.setup.players) + 1)
    return Replay(
        setup=game.setup,
        interfaces={player: seat.options for player, seat in game.seats.items()},
        loops=game.world.loop,
        results={player: int(game.world.players[player].result) for player in players},
        races={player: game.world.players[player].race for player in players},
        log=game.past,
    )


def rerun(replay: Replay, version: str) -> HostedGame:
    """Return a game that plays a replay, with the players in their seats."""
    game = HostedGame(replay.setup, version, log=replay.log, end_loop=replay.loops)
    for number, recorded in replay.interfaces.items():
        game.sit(number, recorded)
    game.step(0)  # it may have ended before its first loop
    return game
