"""A guest at the websocket of its game, with a game that only answers: how it comes, plays and goes away."""

from __future__ import annotations

import contextlib
import shlex
import socket
import sys
import threading
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
import websocket
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.errors import GameError
from khala_bridge.game.guest import Guest
from khala_bridge.game.invitation import Invitation
from khala_bridge.game.manners import LanPorts
from khala_bridge.task.opponent import Opponent
from khala_protocol.trust import Untrusted, trust

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

STATUS = {"join_game": sc_pb.in_game, "step": sc_pb.in_game, "leave_game": sc_pb.launched}


class Game:
    """The game process of a guest and its socket, which notes what arrives."""

    def __init__(self) -> None:
        self.kinds: list[str] = []
        self.left = threading.Event()
        self.running = True
        self.controller = SimpleNamespace(_client=SimpleNamespace(_sock=self))
        self._proc = SimpleNamespace(kill=self.close)

    def settimeout(self, _: float | None) -> None:
        pass

    def send_binary(self, data: bytes) -> None:
        self.kinds.append(str(sc_pb.Request.FromString(data).WhichOneof("request")))

    def recv(self) -> bytes:
        kind = self.kinds[-1]
        answer = sc_pb.Response(status=STATUS[kind])
        getattr(answer, kind).SetInParent()
        if kind == "leave_game":
            self.left.set()
        return answer.SerializeToString()

    def close(self) -> None:
        self.running = False


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextlib.contextmanager
def invited(bot: Any, invitation: Invitation | None = None, **opponent: Any) -> Iterator[tuple[Guest, Game]]:
    """Yield a guest that has joined; `bot` plays it, and gets its websocket."""
    game, port = Game(), free_port()

    def visit() -> None:
        client = websocket.create_connection(f"ws://127.0.0.1:{port}/sc2api")
        try:
            bot(client)
            client.close()
        finally:
            client.shutdown()  # type: ignore[no-untyped-call]  # of websocket-client

    playing = threading.Thread(target=visit)

    def play(_: str) -> None:
        playing.start()

    chosen = Opponent(kind="guest", **{"wait_s": 20, **opponent})
    guest = Guest(game, LanPorts(port, 1, 2, 3, 4, 5), chosen, invitation or Invitation(say=play))
    try:
        guest.invite(None)
        guest.until_joined()
        yield guest, game
    finally:
        guest.close(farewell=False)
        if playing.ident is not None:
            playing.join()


def ask(client: websocket.WebSocket, **request: Any) -> sc_pb.Response:
    client.send_binary(sc_pb.Request(**request).SerializeToString())
    answer: Any = client.recv()
    return sc_pb.Response.FromString(answer)


def join(client: websocket.WebSocket) -> None:
    ask(client, join_game=sc_pb.RequestJoinGame(player_name="Rush", race=common_pb2.Zerg))


def closes(client: websocket.WebSocket) -> None:
    join(client)
    ask(client, step=sc_pb.RequestStep(count=1))


def gives_up(client: websocket.WebSocket) -> None:
    join(client)
    ask(client, leave_game=sc_pb.RequestLeaveGame())


def quits(client: websocket.WebSocket) -> None:
    join(client)
    ask(client, quit=sc_pb.RequestQuit())


def falls_silent(client: websocket.WebSocket) -> None:
    join(client)
    client.recv()  # until it is sent away


@pytest.mark.parametrize(
    ("bot", "forfeit"),
    [(closes, "guest gone"), (quits, "guest gone"), (gives_up, "guest left"), (falls_silent, "guest hung")],
)
def test_a_guest_that_goes_away_leaves_the_game_and_it_is_known_how(bot: Any, forfeit: str) -> None:
    with invited(bot, wait_s=1) as (guest, game):
        assert guest.name == "guest bot Rush, zerg"
        assert game.left.wait(10)
        assert guest.forfeit == forfeit
    assert game.kinds.count("leave_game") == 1


def test_a_guest_that_does_not_come_is_given_up() -> None:
    said: list[str] = []
    late = pytest.raises(GameError, match=r"^no guest joined within 0.2 s: start the bot with --LadderServer 127.0.0.1")
    with late, invited(None, Invitation(say=said.append), wait_s=0.2):
        pass
    (line,) = said
    assert line.startswith("start the bot: python run.py --LadderServer 127.0.0.1 --GamePort ")
    assert line.endswith(" --StartPort 0 --OpponentId khala")


def test_a_match_that_is_given_up_waits_for_no_guest() -> None:
    invitation = Invitation(say=lambda _: invitation.withdrawn.set())
    with pytest.raises(GameError, match="was given up before the guest joined"), invited(None, invitation):
        pass


@pytest.mark.parametrize(
    ("command", "error"),
    [
        (
            [sys.executable, "-c", "raise SystemExit('no luck')"],
            r"^the guest ended with code 1 before it joined: no luck$",
        ),
        (["no/such/bot"], r"^the guest cannot be started with no/such/bot: No such file or directory$"),
    ],
)
def test_a_guest_that_does_not_start_says_why(command: list[str], error: str, tmp_path: Path) -> None:
    invitation = Invitation(log=tmp_path / "guest.log")
    with pytest.raises(Untrusted), invited(None, invitation, command=command):
        pass
    trust(shlex.join(command))
    with pytest.raises(GameError, match=error), invited(None, invitation, command=command):
        pass
