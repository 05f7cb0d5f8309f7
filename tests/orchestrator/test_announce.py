"""Under which keys the host speaks, in which order, and who hears it that comes later; on a clock that jumps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_orchestrator.publish.announce import Announcer
from khala_orchestrator.roster import Seat
from khala_protocol.bus import Delivery
from khala_protocol.codec import decode
from khala_protocol.errors import BusClosed
from khala_protocol.messages import Briefing, Casualties, Message, Report, Result

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from khala_protocol.bus import Sample, Subscription
    from khala_protocol.bus.memory import MemoryBroker
    from khala_protocol.messages import Run

    Drain = Callable[[Subscription[Sample]], Awaitable[list[Sample]]]

CLOCK = "jumps"

RUN = "test"
SEATS = (Seat("blue", "Stalkers"), Seat("blue", "Zealots"))


def briefing(agent: str, episode: int = 0) -> Briefing:
    return Briefing(run=RUN, side="blue", agent=agent, episode=episode, role="You command.")


def message(agent: str, text: str) -> Message:
    return Message(run=RUN, side="blue", agent=agent, episode=0, step=0, recipient="Zealots", text=text)


def report(step: int) -> Report:
    return Report(run=RUN, episode=0, step=step, game_loop=11 * step, agents=())


def result(episode: int = 0) -> Result:
    return Result(
        run=RUN, episode=episode, outcome="draw", cause="step limit", steps=2, game_loop=22, game_s=1.0, wall_s=0.1,
        killed=Casualties(), lost=Casualties(), kd=None,
    )  # fmt: skip


async def speak(announcer: Announcer, card: Run) -> None:
    await announcer.run(card)
    for agent in ("Stalkers", "Zealots"):
        await announcer.brief(briefing(agent))
    await announcer.message(message("Stalkers", "go"))
    for step in range(2):
        await announcer.report(report(step))
    await announcer.result(result())


async def test_all_is_said_in_order_under_the_key_of_its_kind(
    broker: MemoryBroker, card: Callable[..., Run], drain: Drain
) -> None:
    samples = await broker.session().subscribe("**", Delivery.STATE)
    async with Announcer(broker.session(), RUN, SEATS) as announcer:
        await speak(announcer, card())
    said = await drain(samples)
    assert [sample.key for sample in said] == [
        "khala/test/run",
        "khala/test/blue/Stalkers/briefing",
        "khala/test/blue/Zealots/briefing",
        "khala/test/blue/Stalkers/message",
        "khala/test/report",
        "khala/test/report",
        "khala/test/result",
    ]
    assert [decode(sample.payload) for sample in said] == [
        card(),
        briefing("Stalkers"),
        briefing("Zealots"),
        message("Stalkers", "go"),
        report(0),
        report(1),
        result(),
    ]


async def test_one_that_joins_late_gets_what_still_holds_and_not_what_was_said(
    broker: MemoryBroker, card: Callable[..., Run], drain: Drain
) -> None:
    async with Announcer(broker.session(), RUN, SEATS) as announcer:
        await speak(announcer, card())
        await announcer.brief(briefing("Zealots", episode=1))
        late = await broker.session().subscribe("**", Delivery.STATE)
        found = [decode(sample.payload) for sample in await drain(late)]
    assert found == [card(), result(), briefing("Stalkers"), briefing("Zealots", episode=1)]


async def test_a_briefing_that_holds_already_is_not_published_again(broker: MemoryBroker, drain: Drain) -> None:
    samples = await broker.session().subscribe("**", Delivery.STATE)
    async with Announcer(broker.session(), RUN, SEATS) as announcer:
        for episode in (0, 0, 1):
            await announcer.brief(briefing("Stalkers", episode))
    assert [decode(sample.payload) for sample in await drain(samples)] == [
        briefing("Stalkers"),
        briefing("Stalkers", 1),
    ]


async def test_an_agent_without_a_seat_cannot_be_briefed(broker: MemoryBroker) -> None:
    async with Announcer(broker.session(), RUN, SEATS) as announcer:
        with pytest.raises(KeyError):
            await announcer.brief(briefing("Probes"))


async def test_after_its_end_nothing_is_said_and_nothing_is_left(
    broker: MemoryBroker, card: Callable[..., Run], drain: Drain
) -> None:
    async with Announcer(broker.session(), RUN, SEATS) as announcer:
        await speak(announcer, card())
    with pytest.raises(BusClosed):
        await announcer.run(card())
    assert await drain(await broker.session().subscribe("**", Delivery.STATE)) == []
