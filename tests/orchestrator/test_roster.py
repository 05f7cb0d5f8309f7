"""Who is there, who is waited for at the start, and who went away; on a clock that jumps."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

from khala_orchestrator.roster import MissingAgents, Roster, Seat
from khala_protocol.keys import alive_key

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from khala_protocol.bus.memory import MemoryBroker
    from tests.orchestrator.conftest import Peer

    MakePeer = Callable[[Seat], Peer]

CLOCK = "jumps"

RUN = "test"
ZEALOTS, STALKERS = Seat("p1", "Zealots"), Seat("p1", "Stalkers")


@asynccontextmanager
async def called(broker: MemoryBroker, *seats: Seat) -> AsyncIterator[tuple[Roster, list[Seat]]]:
    """A roster, and the seats that it said were left."""
    gone: list[Seat] = []
    async with Roster(broker.session(), RUN, seats or (ZEALOTS, STALKERS)) as roster:
        roster.on_change(gone=gone.append, here=_greet)
        yield roster, gone


async def _greet(seat: Seat) -> None:
    """Take no note of who comes."""


async def settle() -> None:
    """Until all that was announced has been taken note of."""
    await asyncio.sleep(0.001)


async def test_nobody_is_there_at_first(broker: MemoryBroker) -> None:
    async with called(broker) as (roster, _):
        assert roster.seats == roster.missing() == (ZEALOTS, STALKERS)


async def test_one_that_came_before_the_host_is_there(broker: MemoryBroker, peer: MakePeer) -> None:
    await peer(STALKERS).arrive()
    async with called(broker) as (roster, _):
        await settle()
        assert roster.missing() == (ZEALOTS,)
        assert roster.is_present(STALKERS)


async def test_it_assembles_as_soon_as_the_last_required_agent_is_there(broker: MemoryBroker, peer: MakePeer) -> None:
    async with called(broker) as (roster, _):
        waiting = asyncio.create_task(roster.assemble([ZEALOTS, STALKERS], timeout_s=60))
        await asyncio.sleep(10)
        await peer(STALKERS).arrive()
        await asyncio.sleep(10)
        assert not waiting.done()
        await peer(ZEALOTS).arrive()
        await waiting
        assert asyncio.get_running_loop().time() == 20


async def test_an_optional_agent_is_not_waited_for(broker: MemoryBroker, peer: MakePeer) -> None:
    await peer(ZEALOTS).arrive()
    async with called(broker) as (roster, _):
        await roster.assemble([ZEALOTS], timeout_s=60)
        assert asyncio.get_running_loop().time() == 0
        assert roster.missing() == (STALKERS,)


async def test_nobody_required_is_nobody_waited_for(broker: MemoryBroker) -> None:
    async with called(broker) as (roster, _):
        await roster.assemble([], timeout_s=60)
        assert asyncio.get_running_loop().time() == 0


async def test_agents_that_do_not_come_are_named_when_the_time_is_over(
    broker: MemoryBroker, peer: MakePeer, subtests: pytest.Subtests
) -> None:
    both = "p1/Zealots, p1/Stalkers"
    start = "start one with `khala agent {} --side p1 --run … --connect …`"
    for coming, timeout_s, said in (
        ([], 60.0, f"no agent took the place of {both} within 60 s: {start.format('Zealots')}"),
        ([ZEALOTS], 0.5, f"no agent took the place of p1/Stalkers within 0.5 s: {start.format('Stalkers')}"),
    ):
        with subtests.test(coming=coming):
            there = [peer(seat) for seat in coming]
            for one in there:
                await one.arrive()
            began = asyncio.get_running_loop().time()
            async with called(broker) as (roster, _):
                with pytest.raises(MissingAgents) as raised:
                    await roster.assemble([ZEALOTS, STALKERS], timeout_s)
            assert str(raised.value) == said
            assert raised.value.missing == tuple(s for s in (ZEALOTS, STALKERS) if s not in coming)
            assert asyncio.get_running_loop().time() == began + timeout_s
            for one in there:
                one.bus.kill()


async def test_one_that_came_and_went_before_the_others_is_missing(broker: MemoryBroker, peer: MakePeer) -> None:
    zealots = peer(ZEALOTS)
    await zealots.arrive()
    async with called(broker) as (roster, _):
        waiting = asyncio.create_task(roster.assemble([ZEALOTS, STALKERS], timeout_s=60))
        await settle()
        await zealots.leave()
        await settle()
        await peer(STALKERS).arrive()
        with pytest.raises(MissingAgents, match="the place of p1/Zealots within"):
            await waiting


async def test_who_leaves_is_said_once_and_may_come_back(broker: MemoryBroker, peer: MakePeer) -> None:
    zealots = peer(ZEALOTS)
    await zealots.arrive()
    async with called(broker) as (roster, gone):
        await settle()
        await zealots.leave()
        await settle()
        assert (roster.is_present(ZEALOTS), gone) == (False, [ZEALOTS])
        await zealots.arrive("2")
        await settle()
        assert (roster.is_present(ZEALOTS), gone) == (True, [ZEALOTS])


async def test_an_agent_may_leave_before_anybody_asks_to_hear_of_it(broker: MemoryBroker, peer: MakePeer) -> None:
    zealots = peer(ZEALOTS)
    async with Roster(broker.session(), RUN, [ZEALOTS]) as roster:
        await zealots.arrive()
        await settle()
        await zealots.leave()
        await settle()
        assert not roster.is_present(ZEALOTS)


async def test_an_agent_is_gone_when_its_last_instance_is(
    broker: MemoryBroker, peer: MakePeer, caplog: pytest.LogCaptureFixture
) -> None:
    old, new = peer(ZEALOTS), peer(ZEALOTS)
    await old.arrive("1")
    await new.arrive("2")
    async with called(broker) as (roster, gone):
        await settle()
        assert caplog.messages == ["2 processes are agent p1/Zealots: the first reply of a step counts"]
        old.bus.kill()
        await settle()
        assert (roster.is_present(ZEALOTS), gone) == (True, [])
        new.bus.kill()
        await settle()
        assert (roster.is_present(ZEALOTS), gone) == (False, [ZEALOTS])


async def test_agents_that_have_no_seat_are_named_and_count_for_nothing(
    broker: MemoryBroker, peer: MakePeer, caplog: pytest.LogCaptureFixture
) -> None:
    strangers = [peer(Seat("p1", "Probe")), peer(Seat("p2", "Zealots"))]
    for stranger in strangers:
        await stranger.arrive()
    async with called(broker, ZEALOTS) as (roster, gone):
        await settle()
        strangers[0].bus.kill()
        await settle()
        assert (roster.missing(), gone) == ((ZEALOTS,), [])
    assert caplog.messages == [
        "agent p1/Probe is not in this match",
        "agent p2/Zealots is not in this match",
    ]


async def test_a_crowd_under_one_name_is_taken_note_of_up_to_a_limit(broker: MemoryBroker, peer: MakePeer) -> None:
    zealots = peer(ZEALOTS)
    for number in range(100):
        await zealots.arrive(str(number))
    async with called(broker) as (roster, _):
        await settle()
        assert roster.is_present(ZEALOTS)
        assert len(roster._instances[ZEALOTS]) == 16


async def test_agents_of_another_run_are_not_seen(broker: MemoryBroker, caplog: pytest.LogCaptureFixture) -> None:
    await broker.session().announce(alive_key("other", *ZEALOTS, "1"))
    async with called(broker) as (roster, _):
        await settle()
        assert roster.missing() == (ZEALOTS, STALKERS)
    assert not caplog.messages


async def test_a_token_whose_key_is_none_is_named_and_passed_over(
    broker: MemoryBroker, peer: MakePeer, caplog: pytest.LogCaptureFixture
) -> None:
    await broker.session().announce(f"khala/{RUN}/p1/Zealots/alive/an instance")
    await peer(STALKERS).arrive()
    async with called(broker) as (roster, _):
        await settle()
        assert roster.missing() == (ZEALOTS,)
    assert caplog.messages == ["'khala/test/p1/Zealots/alive/an instance' is no key of this protocol"]


async def test_with_the_own_link_down_nobody_is_gone(broker: MemoryBroker, peer: MakePeer) -> None:
    session = broker.session()
    await peer(ZEALOTS).arrive()
    gone: list[Seat] = []
    async with Roster(session, RUN, [ZEALOTS]) as roster:
        roster.on_change(gone=gone.append, here=_greet)
        await settle()
        session.cut()
        await settle()
        assert (roster.is_present(ZEALOTS), roster.is_reachable(ZEALOTS), gone) == (True, False, [ZEALOTS])
        session.mend()
        await asyncio.sleep(2)
        assert (roster.is_present(ZEALOTS), roster.is_reachable(ZEALOTS), gone) == (True, True, [ZEALOTS])


async def test_one_that_leaves_while_our_link_is_down_is_gone_when_it_is_back(
    broker: MemoryBroker, peer: MakePeer
) -> None:
    session, zealots = broker.session(), peer(ZEALOTS)
    await zealots.arrive()
    await peer(STALKERS).arrive()
    async with Roster(session, RUN, [ZEALOTS, STALKERS]) as roster:
        await settle()
        session.cut()
        await settle()
        zealots.bus.kill()
        await settle()
        session.mend()
        await asyncio.sleep(2)
        assert roster.missing() == (ZEALOTS,)


def test_a_seat_is_written_as_it_stands_in_a_key() -> None:
    assert str(ZEALOTS) == "p1/Zealots"
