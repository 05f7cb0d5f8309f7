"""What a guest asks of its game is passed on, changed or answered without the game."""

from __future__ import annotations

from typing import Any

import pytest
from s2clientprotocol import common_pb2, debug_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.game.manners import GuestRequest, LanPorts, Manners

PORTS = LanPorts(5000, 5001, 5002, 5003, 5004, 5005)


def read(manners: Manners, **request: Any) -> GuestRequest:
    return manners.read(sc_pb.Request(id=7, **request).SerializeToString())


def note(manners: Manners, status: Any = sc_pb.in_game, **response: Any) -> bool:
    return manners.note(sc_pb.Response(status=status, **response).SerializeToString())


def test_what_a_player_asks_is_passed_on_as_it_is() -> None:
    request = sc_pb.Request(step=sc_pb.RequestStep(count=4)).SerializeToString()
    assert Manners(PORTS).read(request) == GuestRequest("step", passed=request)


def test_a_guest_joins_on_the_ports_of_the_host_whatever_it_made_of_the_first_one() -> None:
    manners = Manners(PORTS)
    join = sc_pb.RequestJoinGame(race=common_pb2.Zerg, player_name="Rush")
    join.server_ports.game_port = join.server_ports.base_port = 1
    passed = sc_pb.Request.FromString(read(manners, join_game=join).passed).join_game
    assert (passed.server_ports.game_port, passed.server_ports.base_port) == (5002, 5003)
    assert [(ports.game_port, ports.base_port) for ports in passed.client_ports] == [(5004, 5005)]
    assert (manners.name, manners.race, PORTS.start) == ("Rush", "zerg", 5000)


def test_a_guest_does_not_see_through_the_fog() -> None:
    asked = read(Manners(PORTS), observation=sc_pb.RequestObservation(disable_fog=True, game_loop=3))
    passed = sc_pb.Request.FromString(asked.passed).observation
    assert (passed.disable_fog, passed.game_loop) == (False, 3)


@pytest.mark.parametrize(
    ("request_", "kind", "error"),
    [
        (
            {"create_game": sc_pb.RequestCreateGame()},
            None,
            "create_game is not for a guest: the host has created the game",
        ),
        ({"debug": sc_pb.RequestDebug(debug=[debug_pb2.DebugCommand(game_state=debug_pb2.show_map)])}, "debug", ""),
        ({"quit": sc_pb.RequestQuit()}, "quit", ""),
    ],
)
def test_what_is_not_for_a_guest_does_not_reach_the_game(
    request_: dict[str, Any], kind: str | None, error: str
) -> None:
    asked = read(Manners(PORTS), **request_)
    assert asked.passed == b""
    answer = sc_pb.Response.FromString(asked.answer or b"")
    assert (answer.id, answer.WhichOneof("response"), "".join(answer.error)) == (7, kind, error)


def test_a_game_says_whether_it_took_the_guest_and_is_going_on() -> None:
    manners = Manners(PORTS)
    refusal = sc_pb.ResponseJoinGame(error=sc_pb.ResponseJoinGame.GameFull, error_details="No place")
    assert note(manners, sc_pb.launched, join_game=refusal)
    assert (manners.refused, manners.playing) == ("GameFull: No place", False)
    assert not note(manners, step=sc_pb.ResponseStep())
    assert manners.playing
