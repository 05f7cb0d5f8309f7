"""What a guest may ask of its game: requests are passed on, changed, or answered without the game.

A function of bytes, without a socket. A guest plays as a ladder lets it: it neither sees through the fog nor changes
the game, and it ends its own part of the game only.
"""

from __future__ import annotations

from typing import NamedTuple

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

_REFUSED = frozenset(
    {"create_game", "restart_game", "start_replay", "quick_save", "quick_load", "save_map", "map_command"}
)
"""What is the host's: Khala has created the game."""
_UNHEARD = frozenset({"debug"})
"""Answered as if done: bots draw with it for people who watch, and it could make units."""


class LanPorts(NamedTuple):
    """Ports by which two clients meet, in the order in which ladders count them from the first one."""

    websocket: int
    shared: int
    """Of old clients; unused."""
    host_game: int
    host_base: int
    guest_game: int
    guest_base: int

    @property
    def start(self) -> int:
        """`StartPort` of ladders: the host's ports are two and three above it, the guest's four and five."""
        return self.host_game - 2

    def write(self, join: sc_pb.RequestJoinGame) -> None:
        """Put them into a request; both clients must send the same."""
        join.shared_port = 0
        join.server_ports.game_port, join.server_ports.base_port = self.host_game, self.host_base
        del join.client_ports[:]
        join.client_ports.add(game_port=self.guest_game, base_port=self.guest_base)


class GuestRequest(NamedTuple):
    """One request: either it is passed on to the game, or here is its answer."""

    kind: str
    """By the API's name, `join_game`."""
    passed: bytes = b""
    answer: bytes | None = None


class Manners:
    """One guest's requests and the answers to them."""

    def __init__(self, ports: LanPorts) -> None:
        self.name, self.race = "", "random"
        self.refused = ""
        """Why the game did not take it."""
        self._ports = ports
        self._status = sc_pb.launched

    @property
    def playing(self) -> bool:
        """Whether its game is going on."""
        return self._status == sc_pb.in_game

    def read(self, data: bytes) -> GuestRequest:
        """Return what becomes of a request.

        Raises:
            DecodeError: it is none.
        """
        request = sc_pb.Request.FromString(data)
        kind = request.WhichOneof("request") or ""
        answer = sc_pb.Response(id=request.id, status=self._status)
        if kind in _REFUSED:
            answer.error.append(f"{kind} is not for a guest: the host has created the game")
        elif kind in _UNHEARD:
            getattr(answer, kind).SetInParent()
        elif kind == "quit":
            answer.status = sc_pb.quit
            answer.quit.SetInParent()
        else:
            return GuestRequest(kind, passed=self._adapt(request, data))
        return GuestRequest(kind, answer=answer.SerializeToString())

    def note(self, data: bytes) -> bool:
        """Take an answer of the game; return whether it is the one to the request to join."""
        response = sc_pb.Response.FromString(data)
        self._status = response.status
        if response.HasField("join_game") and response.join_game.HasField("error"):
            self.refused = sc_pb.ResponseJoinGame.Error.Name(response.join_game.error)
            self.refused += f": {response.join_game.error_details}" if response.join_game.error_details else ""
        return response.HasField("join_game")

    def _adapt(self, request: sc_pb.Request, data: bytes) -> bytes:
        if request.HasField("observation") and request.observation.disable_fog:
            request.observation.disable_fog = False
        elif request.HasField("join_game"):
            join = request.join_game
            self.name = join.player_name
            self.race = common_pb2.Race.Name(join.race).lower()
            self._ports.write(join)
        else:
            return data
        return request.SerializeToString()
