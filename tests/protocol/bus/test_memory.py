"""What the in-memory bus can simulate: death and broken links."""

from __future__ import annotations

import pytest

from khala_protocol.bus import Delivery, Liveness, Sample
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.bus.testing import take
from khala_protocol.errors import BusClosed


async def test_a_killed_session_is_silent_and_its_tokens_and_states_are_gone() -> None:
    broker = MemoryBroker()
    host, agent, late = broker.session(), broker.session(), broker.session()
    watch = await host.watch("**")
    await agent.announce("a/alive")
    publisher = await agent.publisher("a/state", Delivery.STATE)
    await publisher.put(b"x")
    agent.kill()
    assert await take(watch, 2) == [Liveness("a/alive", alive=True), Liveness("a/alive", alive=False, link_up=True)]
    with pytest.raises(BusClosed):
        await publisher.put(b"y")
    subscription = await late.subscribe("**", Delivery.STATE)
    await late.close()
    assert [sample async for sample in subscription] == []


async def test_a_cut_link_is_blamed_on_the_side_that_lost_it() -> None:
    broker = MemoryBroker()
    host, agent, other = broker.session(), broker.session(), broker.session()
    for session, name in ((agent, "agent"), (other, "other")):
        await session.announce(f"{name}/alive")
    seen_by_host, seen_by_agent = await host.watch("**"), await agent.watch("other/*")
    await take(seen_by_host, 2)
    await take(seen_by_agent, 1)
    agent.cut()
    assert await take(seen_by_host, 1) == [Liveness("agent/alive", alive=False, link_up=True)]
    assert await take(seen_by_agent, 1) == [Liveness("other/alive", alive=False, link_up=False)]
    agent.mend()
    assert await take(seen_by_host, 1) == [Liveness("agent/alive", alive=True)]
    assert await take(seen_by_agent, 1) == [Liveness("other/alive", alive=True)]


async def test_after_a_cut_the_newest_state_arrives_and_the_missed_are_counted() -> None:
    broker = MemoryBroker()
    host, agent = broker.session(), broker.session()
    states = await agent.subscribe("state", Delivery.STATE)
    speech = await agent.subscribe("speech", Delivery.SPEECH)
    say, show = await host.publisher("speech", Delivery.SPEECH), await host.publisher("state", Delivery.STATE)
    await show.put(b"0")
    agent.cut()
    for payload in (b"1", b"2", b"3"):
        await show.put(payload)
        await say.put(payload)
    agent.mend()
    await say.put(b"4")
    assert await take(states, 2) == [Sample("state", b"0"), Sample("state", b"3")]
    assert states.missed == 2
    assert await take(speech, 1) == [Sample("speech", b"4")]
