"""Requests that start a game: join it, alone or with other processes, as a player or as an observer; restart it.

Above: `requests.py`. Below: `game.py`, `viewer.py`, `lan.py`.
"""

from __future__ import annotations

import dataclasses
import json
from typing import TYPE_CHECKING

import numpy as np
from google.protobuf.message import DecodeError
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.game import HostedGame, Setup
from khala_simulator.api.game_info import GameInfo
from khala_simulator.api.projection import size_problem
from khala_simulator.api.viewer import Viewer
from khala_simulator.process.clock import RealtimeClock, SharedClock
from khala_simulator.process.lan import JoinRefused, LanDoor, NobodyCameError, Peers, knock
from khala_simulator.process.lockstep import Lockstep
from khala_simulator.process.process import Failure, Party, Playing, Process
from khala_simulator.process.replay import Replay, ReplayError
from khala_simulator.tables.catalog import CatalogError

if TYPE_CHECKING:
    from khala_simulator.process.lan import LanLink

PATIENCE_S = 100.0
"""How long a process waits for the others: less than the two minutes after which PySC2 gives a game up."""

_JoinError = sc.ResponseJoinGame.Error
_TAKEN, _REFUSED = b"+", b"-"  # first byte of the host's answer


async def join_game(process: Process, request: sc.RequestJoinGame) -> sc.ResponseJoinGame:
    """Take a place, and start the game when all members are there."""
    _check(request)
    setup = process.setup
    over_lan = request.HasField("server_ports")
    if setup is None:
        if not over_lan:
            raise _failure(_JoinError.MapDoesNotExist, "No game was created here")
        return await _visit(process, request)
    table = Seating(setup)
    me = table.take(request)
    if table.full:
        process.play(begin(process, table.party(me)))
    elif over_lan:
        process.play(await _host(process, table, me, request.server_ports.game_port))
    else:
        text = f"{len(table.free)} more have to join, each with its own process: name the ports on which they meet"
        raise _failure(_JoinError.MissingPorts, text)
    return sc.ResponseJoinGame(player_id=me)


def restart_game(process: Process, _: sc.RequestRestartGame) -> sc.ResponseRestartGame:
    """Restart the same game, with other random draws."""
    before = process.table
    if before.party is None or before.peers is not None:
        text = "A replay is not restarted" if before.replay else "Only a game of one process can be restarted"
        raise Failure(sc.ResponseRestartGame(error=sc.ResponseRestartGame.LaunchError, error_details=text))
    party = before.party
    episode = before.episode + 1
    seed = int(np.random.SeedSequence([party.setup.seed, episode]).generate_state(1)[0])
    fresh = dataclasses.replace(party, setup=dataclasses.replace(party.setup, seed=seed))
    process.play(dataclasses.replace(begin(process, fresh), party=party, episode=episode))
    return sc.ResponseRestartGame(need_hard_reset=False)


def begin(process: Process, party: Party) -> Playing:
    """Return a game at its first loop, with all members in their seats."""
    try:
        game = HostedGame(party.setup, process.tables)
    except CatalogError as error:
        raise _failure(_JoinError.CannotOpenMap, f"{party.setup.path}: {error}") from error
    for player, options in party.interfaces.items():
        game.sit(player, options)
    if party.watched is None:
        seat = game.seats[party.me]
        for other in game.seats.values():
            other.unread = other is not seat
    else:
        seat = Viewer(game, party.watched, party.options)
    clock = RealtimeClock(game) if party.setup.realtime else None
    return Playing(game, seat, GameInfo(game, seat), clock=clock, party=party)


# places ---------------------------------------------------------------------------------------------------------------


def _failure(error: _JoinError.ValueType, details: str) -> Failure:
    return Failure(sc.ResponseJoinGame(error=error, error_details=details))


def _check(request: sc.RequestJoinGame) -> None:
    if request.WhichOneof("participation") is None:
        raise _failure(_JoinError.MissingParticipation, "Name the race to play, or the player to observe")
    if not request.HasField("options"):
        raise _failure(_JoinError.MissingOptions, "Say what to observe")
    if problem := size_problem(request.options):
        raise _failure(_JoinError.OtherError, problem)


class Seating:
    """The places of a created game and their members; members are numbered like the players, then the observers."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._joined: dict[int, sc.RequestJoinGame] = {}
        self.free = [number for number, asked in enumerate(setup.players, start=1) if asked.type == sc.Participant]
        self.free += range(len(setup.players) + 1, len(setup.players) + len(setup.observers) + 1)

    @property
    def full(self) -> bool:
        """Whether all members are there."""
        return not self.free

    def take(self, request: sc.RequestJoinGame) -> int:
        """Take the first free place of the right kind, and return its number; raise Failure if there is none."""
        observes = request.HasField("observed_player_id")
        players = len(self._setup.players)
        if observes and request.observed_player_id > players:
            raise _failure(_JoinError.InvalidObservedPlayerId, f"There is no player {request.observed_player_id}")
        number = next((number for number in self.free if (number > players) == observes), None)
        if number is None:
            kind = "an observer" if observes else "a participant"
            raise _failure(_JoinError.GameFull, f"No place for {kind} is free")
        self.free.remove(number)
        self._joined[number] = request
        return number

    def release(self, number: int) -> None:
        """Free a place."""
        del self._joined[number]
        self.free = sorted([*self.free, number])

    def party(self, me: int) -> Party:
        """Return all members in their places, as one of them sees it."""
        players = list(self._setup.players)
        interfaces = {}
        for number, request in self._joined.items():
            if number > len(players):
                continue
            interfaces[number] = request.options
            player = players[number - 1] = sc.PlayerSetup.FromString(players[number - 1].SerializeToString())
            player.race = request.race
            if request.player_name:
                player.player_name = request.player_name
        setup = dataclasses.replace(self._setup, players=tuple(players))
        return _party(setup, dict(sorted(interfaces.items())), me, self._joined[me])


def _party(setup: Setup, interfaces: dict[int, sc.InterfaceOptions], me: int, request: sc.RequestJoinGame) -> Party:
    watched = request.observed_player_id if request.HasField("observed_player_id") else None
    return Party(setup, interfaces, me, watched, request.options)


# over several processes -----------------------------------------------------------------------------------------------


async def _host(process: Process, table: Seating, me: int, port: int) -> Playing:
    """Wait for the guests, and starts the game for all."""
    build = process.base_build

    def admit(message: bytes) -> int:
        try:
            return table.take(_read_join(message, build))
        except Failure as failure:
            raise JoinRefused(_REFUSED + failure.body.SerializeToString()) from failure

    door = LanDoor(admit, table.release)
    try:
        await door.wait(port, PATIENCE_S, lambda: table.full)
        playing = begin(process, table.party(me))
    except (NobodyCameError, OSError) as error:
        raise _failure(_JoinError.NetworkError, str(error)) from error
    except Failure as failure:
        for link in door.guests.values():
            link.send(_REFUSED + failure.body.SerializeToString())
        door.send_away()
        raise
    members = sorted([me, *door.guests])
    for number, link in door.guests.items():
        link.send(_TAKEN + json.dumps({"me": number, "members": members}).encode() + b"\n" + _invitation(table, me))
    return _share(playing, me, members, {link: frozenset({number}) for number, link in door.guests.items()})


def _share(playing: Playing, me: int, members: list[int], links: dict[LanLink, frozenset[int]]) -> Playing:
    """Share the game with other processes."""
    playing.peers = Peers(Lockstep(playing.game, me, members), links)
    if playing.clock is not None:
        playing.clock = SharedClock(playing.game)
        playing.peers.keep_time(playing.clock)
    return playing


def _invitation(table: Seating, me: int) -> bytes:
    party = table.party(me)
    return Replay(party.setup, party.interfaces, loops=0, results={}, races={}, log=()).encode()


async def _visit(process: Process, request: sc.RequestJoinGame) -> sc.ResponseJoinGame:
    """Join the game that another process hosts."""
    join = f"{process.base_build}\n".encode() + request.SerializeToString()
    try:
        link, answer = await knock(request.server_ports.game_port, PATIENCE_S, join)
    except NobodyCameError as error:
        raise _failure(_JoinError.NetworkError, str(error)) from error
    try:
        playing, me = _accept(process, request, link, answer)
    except Failure:
        link.close()
        raise
    process.play(playing)
    return sc.ResponseJoinGame(player_id=me)


def _accept(process: Process, request: sc.RequestJoinGame, link: LanLink, answer: bytes) -> tuple[Playing, int]:
    head, _, invitation = answer.removeprefix(_TAKEN).partition(b"\n")
    try:
        if answer.startswith(_REFUSED):
            raise Failure(sc.ResponseJoinGame.FromString(answer[len(_REFUSED) :]))
        fields = json.loads(head)
        me = int(fields["me"])
        members = [int(member) for member in fields["members"]]
        replay = Replay.decode(invitation)
    except (ValueError, LookupError, TypeError, ReplayError, DecodeError) as error:
        raise _failure(_JoinError.NetworkError, f"That is no host of a game: {error}") from error
    playing = begin(process, _party(replay.setup, replay.interfaces, me, request))
    return _share(playing, me, members, {link: frozenset(members) - {me}}), me


def _read_join(message: bytes, build: int) -> sc.RequestJoinGame:
    theirs, _, data = message.partition(b"\n")
    if theirs != str(build).encode():
        raise _failure(_JoinError.NetworkError, f"The host plays build {build}, and the guest another one")
    try:
        return sc.RequestJoinGame.FromString(data)
    except DecodeError as error:
        raise _failure(_JoinError.NetworkError, "That is no guest") from error
