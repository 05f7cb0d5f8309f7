"""The table of legal requests, as clients experience it."""

import pytest
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.status import AFTER, GAME_OVER, LEGAL, Machine, Status, UsageError

KINDS = [field.name for field in sc.Request.DESCRIPTOR.oneofs_by_name["request"].fields]

# What PySC2's own gate admits in each state (its `valid_status` decorators): refusing one of these would
# break a client that plays by the rules.
PYSC2_SENDS = {
    "create_game": {"launched", "ended", "in_game", "in_replay"},
    "save_map": {"launched", "init_game"},
    "restart_game": {"in_game", "ended"},
    "start_replay": {"launched", "ended", "in_game", "in_replay"},
    "game_info": {"in_game", "in_replay"},
    "data": {"in_game", "in_replay"},
    "observation": {"in_game", "in_replay", "ended"},
    "step": {"in_game", "in_replay"},
    "action": {"in_game"},
    "debug": {"in_game"},
    "leave_game": {"in_game", "ended"},
    "query": {"in_game", "in_replay"},
}


def in_state(status: Status) -> Machine:
    machine = Machine()
    machine.status = status
    return machine


def test_states_have_the_numbers_of_the_api() -> None:
    assert {status.name: status.value for status in Status} == {
        name: number for name, number in sc.Status.items() if name != "unknown"
    }


@pytest.mark.parametrize(("kind", "states"), PYSC2_SENDS.items())
def test_what_pysc2_sends_is_legal(kind: str, states: set[str]) -> None:
    for state in states:
        in_state(Status[state]).check(kind)


@pytest.mark.parametrize("kind", KINDS)
def test_every_request_of_the_api_is_legal_somewhere(kind: str) -> None:
    assert any(kind in kinds for kinds in LEGAL.values())


@pytest.mark.parametrize("status", [s for s in Status if s is not Status.quit])
def test_ping_and_quit_are_always_legal(status: Status) -> None:
    in_state(status).check("ping")
    in_state(status).check("quit")


@pytest.mark.parametrize(
    ("status", "kind", "text"),
    [
        (Status.launched, "join_game", "join_game is not possible in state launched, only in: init_game"),
        (Status.launched, "observation",
         "observation is not possible in state launched, only in: in_game, in_replay, ended"),
        (Status.in_game, "join_game", "join_game is not possible in state in_game, only in: init_game"),
        (Status.in_replay, "save_replay",
         "save_replay is not possible in state in_replay, only in: in_game, ended"),
        (Status.in_replay, "action", "action is not possible in state in_replay, only in: in_game"),
        (Status.ended, "step", "Game has already ended"),
        (Status.ended, "action", "Game has already ended"),
        (Status.ended, "query", "Game has already ended"),
        (Status.ended, "debug", "Game has already ended"),
        (Status.launched, "cheat", "Unknown request: cheat"),
    ],
)  # fmt: skip
def test_an_illegal_request_says_where_it_would_be_legal(status: Status, kind: str, text: str) -> None:
    with pytest.raises(UsageError) as caught:
        in_state(status).check(kind)
    assert str(caught.value) == text


def test_the_sentence_that_clients_take_for_the_end_of_a_game_is_exact() -> None:
    assert GAME_OVER == "Game has already ended"


@pytest.mark.parametrize(
    ("kind", "status"),
    [("create_game", Status.init_game), ("join_game", Status.in_game), ("restart_game", Status.in_game),
     ("start_replay", Status.in_replay), ("leave_game", Status.launched), ("quit", Status.quit)],
)  # fmt: skip
def test_a_request_that_succeeds_moves_on(kind: str, status: Status) -> None:
    machine = Machine()
    machine.move_on(kind)
    assert machine.status is status


@pytest.mark.parametrize("kind", sorted(set(KINDS) - set(AFTER)))
def test_other_requests_stay(kind: str) -> None:
    machine = in_state(Status.in_game)
    machine.move_on(kind)
    assert machine.status is Status.in_game


@pytest.mark.parametrize(
    ("before", "after"),
    [(Status.in_game, Status.ended), (Status.in_replay, Status.ended), (Status.launched, Status.launched),
     (Status.init_game, Status.init_game), (Status.quit, Status.quit)],
)  # fmt: skip
def test_only_a_running_game_ends(before: Status, after: Status) -> None:
    machine = in_state(before)
    machine.end()
    assert machine.status is after
