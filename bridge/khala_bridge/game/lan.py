"""A game that somebody else hosts: what its host says of it, on the port that PySC2's `play_vs_agent` opens for that.

The host sends the map and its settings as soon as somebody connects. If it is on another machine, it has made tunnels
for TCP to this one, and the datagrams of the game travel in the same connection. Above: `khala_bridge.game.meeting`.
"""

from __future__ import annotations

import contextlib
import json
import socket
import time
from typing import TYPE_CHECKING, Any

from khala_bridge.compat import lan_sc2_env
from khala_bridge.errors import GameError
from khala_bridge.game.manners import LanPorts

if TYPE_CHECKING:
    from khala_bridge.game.invitation import Invitation
    from khala_bridge.task.opponent import Opponent

HOST = "127.0.0.1"
_PAUSE_S = 0.2


class LanGame:
    """The connection to a host, and its settings."""

    def __init__(self, opponent: Opponent, map_name: str, invitation: Invitation) -> None:
        """Wait until the host of a game on this map is there.

        Raises:
            GameError: there is none, or it is something else.
        """
        self._udp: socket.socket | None = None
        self._tcp = _connect(opponent, map_name, invitation)
        try:
            self.map_data, settings = _read(self._tcp)
            self.map_name, self.map_path = str(settings["map_name"]), str(settings["map_path"])
            self.realtime = bool(settings["realtime"])
            self.game_version = settings["game_version"]
            ports = settings["ports"]
            server, client = ports["server"], ports["client"]
            self.ports = LanPorts(0, 0, server["game"], server["base"], client["game"], client["base"])
            if settings["remote"]:
                self._forward()
        except (ValueError, LookupError, TypeError, OSError) as error:
            self.close()
            raise GameError(f"the program at {opponent.at} hosts no game of `play_vs_agent`: {error}") from None

    def close(self) -> None:
        """Hang up."""
        for end in (self._tcp, self._udp):
            if end is not None:
                end.close()

    def _forward(self) -> None:
        """Carry the game's datagrams over the connection, as the host does at the other end."""
        self._udp = lan_sc2_env.udp_server(lan_sc2_env.Addr(HOST, self.ports.host_game))
        there = lan_sc2_env.Addr(HOST, self.ports.guest_game)
        lan_sc2_env.daemon_thread(lan_sc2_env.tcp_to_udp, (self._tcp, self._udp, there))
        lan_sc2_env.daemon_thread(lan_sc2_env.udp_to_tcp, (self._udp, self._tcp))


def _connect(opponent: Opponent, map_name: str, invitation: Invitation) -> socket.socket:
    until_s = time.monotonic() + opponent.wait_s
    said = False
    while True:
        with contextlib.suppress(ConnectionRefusedError):
            return socket.create_connection((HOST, opponent.port), timeout=opponent.wait_s)
        if not said:
            host = f"python -m pysc2.bin.play_vs_agent --human --map {map_name} --config_port {opponent.port}"
            invitation.say(f"waiting for a game at {opponent.at}; to host it: {host}")
            said = True
        if time.monotonic() > until_s or invitation.withdrawn.wait(_PAUSE_S):
            raise GameError(f"nobody hosts a game at {opponent.at}: start its host first, or give another --opponent")


def _read(tcp: socket.socket) -> tuple[bytes, dict[str, Any]]:
    map_data, settings = lan_sc2_env.read_tcp(tcp), lan_sc2_env.read_tcp(tcp)
    if not map_data or not settings:
        raise ValueError("it hung up")
    tcp.settimeout(None)
    return map_data, json.loads(settings)
