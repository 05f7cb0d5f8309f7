"""Lock-step without a network: messages in any order of arrival, and messages that no member can have sent."""

from collections import deque

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.game import HostedGame, LogEntry, Setup
from khala_simulator.maps.game_map import load_map
from khala_simulator.process.client import command, interface
from khala_simulator.process.lockstep import Commit, Leave, Lockstep, LockstepError, decode

MEMBERS = frozenset({1, 2, 3})


def game(players: int = 2) -> HostedGame:
    """Return a battle of two, or of three with a third player without units."""
    setup = Setup(
        game_map=load_map("llm_smac/2s3z"),
        map_data=b"",
        path="2s3z",
        players=tuple(sc.PlayerSetup(type=sc.Participant, race=common_pb2.Protoss) for _ in range(players)),
        seed=1,
        disable_fog=False,
        realtime=False,
    )
    made = HostedGame(setup, "4.10")
    for number in range(1, players + 1):
        made.sit(number, interface(screen=0))
    return made


def attack(lockstep: Lockstep, x: float) -> None:
    world = lockstep.game.world
    tags = [world.tag_of(slot) for slot in world.units_of(lockstep.me).tolist()]
    lockstep.game.act(lockstep.me, command(23, tags, point=(x, 16.0)))


# messages -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "message",
    [
        Commit(1, 8),
        Commit(2, 448, (LogEntry(7, 2, sc.Action()), LogEntry(8, 2, command(23, [1, 2], point=(3, 4)))), {448: "abc"}),
        Leave(3, 16),
    ],
)
def test_a_message_survives_the_wire(message: Commit | Leave) -> None:
    assert decode(message.encode(), MEMBERS) == message


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "not a message of a game over several processes: "),
        (b"[]\n", "not a message of a game over several processes: "),
        (b'{"member": 1}\n', "not a message of a game over several processes: "),
        (b'{"member": 1, "through": 8, "digests": {}}\nxyz', "not a message of a game over several processes: "),
        (Commit(4, 8).encode(), "another process sends as member 4"),
        (Leave(4, 8).encode(), "another process sends as member 4"),
    ],
)
def test_what_is_no_message_says_so(data: bytes, text: str) -> None:
    with pytest.raises(LockstepError) as caught:
        decode(data, MEMBERS)
    assert str(caught.value).startswith(text)


@given(st.binary(max_size=200))
def test_no_bytes_break_the_reader(data: bytes) -> None:
    with pytest.raises(LockstepError):
        decode(data, MEMBERS)


@pytest.mark.parametrize(
    "message",
    [
        Commit(2, 4),
        Commit(2, 20, (LogEntry(5, 2, sc.Action()),)),
        Commit(2, 20, (LogEntry(12, 1, sc.Action()),)),
    ],
    ids=["back in time", "into the past", "for another player"],
)
def test_what_a_member_has_promised_not_to_say_is_refused(message: Commit) -> None:
    lockstep = Lockstep(game(), 1, [1, 2])
    lockstep.receive(Commit(2, 10))
    with pytest.raises(LockstepError, match="member 2 says what it has said before, or what is not its to say"):
        lockstep.receive(message)


# the horizon ----------------------------------------------------------------------------------------------------------


def test_the_world_goes_as_far_as_the_most_hesitant_member_allows() -> None:
    lockstep = Lockstep(game(), 1, [1, 2])
    lockstep.commit(10)
    lockstep.advance(100)
    assert lockstep.game.world.loop == 0
    lockstep.receive(Commit(2, 4))
    lockstep.advance(100)
    assert (lockstep.horizon, lockstep.game.world.loop) == (4, 4)
    lockstep.receive(Commit(2, 12))
    lockstep.advance(100)
    assert lockstep.game.world.loop == 10


def test_nobody_waits_for_a_member_that_left_and_nobody_listens_to_it() -> None:
    lockstep = Lockstep(game(), 1, [1, 2])
    lockstep.receive(Commit(2, 6))
    lockstep.commit(10)
    assert lockstep.leave(2) == Leave(2, 6)
    lockstep.receive(Commit(2, 8))
    lockstep.advance(100)
    assert lockstep.members == {1}
    assert lockstep.game.over
    assert [result.result for result in lockstep.game.results()] == [sc.Victory, sc.Defeat]
    assert lockstep.game.world.loop == 6


def test_who_resigns_ends_the_game_where_no_other_world_is_further() -> None:
    one, other = Lockstep(game(), 1, [1, 2]), Lockstep(game(), 2, [1, 2])
    other.receive(one.commit(10))
    other.commit(12)
    other.advance(100)
    message = one.resign()
    assert message == Leave(1, 10)
    assert one.members == frozenset({2})
    assert one.is_decided
    other.receive(message)
    other.advance(100)
    assert (other.game.over, other.game.world.loop) == (True, 10)


def test_what_is_done_after_a_promise_takes_effect_after_it() -> None:
    lockstep = Lockstep(game(), 1, [1, 2])
    attack(lockstep, 20.0)
    assert [entry.loop for entry in lockstep.commit(8).entries] == [1]
    attack(lockstep, 10.0)
    assert [entry.loop for entry in lockstep.commit(9).entries] == [8]


@settings(max_examples=20, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.tuples(st.sampled_from(["act", "step", "hear"]), st.integers(0, 1), st.integers(1, 9)), max_size=60))
def test_however_messages_are_delayed_the_worlds_are_one(moves: list[tuple[str, int, int]]) -> None:
    sides = [Lockstep(game(), number, [1, 2]) for number in (1, 2)]
    mail: list[deque[bytes]] = [deque(), deque()]
    for move, index, number in [*moves, *[("hear", i % 2, 99) for i in range(200)]]:
        side, world = sides[index], sides[index].game.world
        if move == "act":
            attack(side, float(number * 3))
        elif move == "step":
            mail[1 - index].append(side.commit(world.loop + number).encode())
        elif mail[index]:
            side.receive(decode(mail[index].popleft(), frozenset({2 - index})))
        side.advance(number)
        assert world.loop <= side.horizon
    assert sides[0].horizon == sides[1].horizon == sides[0].game.world.loop == sides[1].game.world.loop
    assert sides[0].game.world.digest() == sides[1].game.world.digest()
    assert sides[0].game.past == sides[1].game.past
