"""The access rules of a router: who may read and write which topic, over links of certificates that they were made for.

Each row is tried on a real router, with bare sessions; `bench/survival/strangers.py` tries it in a running match.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Collection
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from khala_protocol.access import REPLY_BYTES, router_settings
from khala_protocol.bus import Delivery, Liveness, Sample
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.testing import take
from khala_protocol.bus.zenoh import ZenohBus, open_bus
from khala_protocol.certificates import certify_adviser, certify_agent, certify_observer, files_of, make_authority

if TYPE_CHECKING:
    from pathlib import Path

Sessions = Callable[[str], Awaitable[ZenohBus]]

A, B, RED, ADA = "khala/r/blue/A", "khala/r/blue/B", "khala/r/red/C", "khala/r/blue/Ada"
TOPICS = [
    "khala/r/run", "khala/r/result", "khala/r/report", "khala/r/terrain", "khala/r/scene", "khala/other/run",
    *(f"{who}/{topic}" for who in (A, B, RED)
      for topic in ("briefing", "observation", "image/0", "reply", "exchange", "message", "advice")),
    f"{ADA}/advice",
]  # fmt: skip
READS = {"khala/r/result", f"{A}/briefing", f"{A}/observation", f"{A}/image/0"}
WRITES = {f"{A}/reply", f"{A}/exchange"}
FOR_ALL = {"khala/r/run", "khala/r/result", "khala/r/report"}
OF_THE_RUN = {topic for topic in TOPICS if not topic.startswith("khala/other")}


@pytest.fixture
async def sessions(tmp_path: Path) -> AsyncIterator[Sessions]:
    """Yield a function that opens a session with a certificate, or returns that of the router."""
    make_authority(tmp_path, ["127.0.0.1"])
    for agent in ("A", "Other"):
        certify_agent(tmp_path, "blue", agent)
    certify_observer(tmp_path, "o")
    certify_adviser(tmp_path, "blue", "Ada")
    rules = router_settings([("blue", "A"), ("blue", "B"), ("red", "C")], "r", advisers=[("blue", "Ada")])
    listening = BusConfig(mode="router", listen=("tls/127.0.0.1:0",), tls=files_of(tmp_path, "router"), zenoh=rules)
    async with AsyncExitStack() as stack:

        async def opened(config: BusConfig) -> ZenohBus:
            bus = await open_bus(config)
            stack.push_async_callback(bus.close)
            return bus

        async def session(name: str) -> ZenohBus:
            if name == "router":
                return router
            return await opened(BusConfig(connect=router.endpoints, tls=files_of(tmp_path, name)))

        router = await opened(listening)
        yield session


async def test_an_agent_reads_and_writes_what_is_its_own(sessions: Sessions) -> None:
    agent, host = await sessions("agent:blue/A"), await sessions("host")
    assert await heard(await sessions("router"), agent, READS) == READS
    assert await heard(agent, host, WRITES) == WRITES


async def test_an_observer_reads_the_run_and_writes_nothing(sessions: Sessions) -> None:
    observer, host = await sessions("observer"), await sessions("host")
    assert await heard(host, observer, OF_THE_RUN) == OF_THE_RUN
    assert await heard(observer, host) == set()


async def test_an_adviser_reads_what_is_for_all_and_writes_its_advice(sessions: Sessions) -> None:
    adviser, host = await sessions("adviser:blue/Ada"), await sessions("host")
    assert await heard(host, adviser, FOR_ALL) == FOR_ALL
    assert await heard(adviser, host, {f"{ADA}/advice"}) == {f"{ADA}/advice"}


async def test_an_adviser_sees_that_the_host_is_there_and_an_agent_cannot_stand_in_for_it(sessions: Sessions) -> None:
    adviser, host, agent = await sessions("adviser:blue/Ada"), await sessions("host"), await sessions("agent:blue/A")
    tokens = await adviser.watch("khala/r/host")
    await agent.announce("khala/r/host")
    token = await host.announce("khala/r/host")
    assert await take(tokens, 1) == [Liveness("khala/r/host", alive=True)]
    await token.close()
    assert await take(tokens, 1) == [Liveness("khala/r/host", alive=False)]


async def test_an_agent_that_is_in_no_task_reads_and_writes_nothing(sessions: Sessions) -> None:
    other, host = await sessions("agent:blue/Other"), await sessions("host")
    assert await heard(host, other) == set()
    assert await heard(other, host) == set()


async def test_an_agent_that_joins_late_gets_the_newest_of_what_it_may_read(sessions: Sessions) -> None:
    agent, host = await sessions("agent:blue/A"), await sessions("host")
    for topic in READS:
        await (await host.publisher(topic, Delivery.STATE)).put(topic.encode())
    for topic in READS:
        assert await take(await agent.subscribe(topic, Delivery.STATE), 1) == [Sample(topic, topic.encode())]


async def test_an_agent_shows_its_own_token_and_no_other(sessions: Sessions) -> None:
    agent, host = await sessions("agent:blue/A"), await sessions("host")
    tokens = await host.watch("khala/r/**")
    for who in (B, RED, A):
        await agent.announce(f"{who}/alive/x")
    assert await take(tokens, 1) == [Liveness(f"{A}/alive/x", alive=True)]


async def test_a_reply_that_is_too_large_does_not_pass(sessions: Sessions) -> None:
    agent, host = await sessions("agent:blue/A"), await sessions("host")
    replies = await host.subscribe(f"{A}/reply", Delivery.SPEECH)
    publisher = await agent.publisher(f"{A}/reply", Delivery.SPEECH)
    await publisher.put(bytes(REPLY_BYTES + 1))
    first = asyncio.ensure_future(anext(replies))
    while not first.done():  # what follows within 2 ms is dropped
        await publisher.put(bytes(REPLY_BYTES))
        await asyncio.wait({first}, timeout=0.02)
    assert len((await first).payload) == REPLY_BYTES


def test_a_router_that_does_not_know_the_run_keeps_the_names_apart() -> None:
    rules = {rule["id"]: rule["key_exprs"] for rule in router_settings([("blue", "A")])["access_control"]["rules"]}
    assert rules["speak:agent:blue/A"] == ["khala/*/blue/A/reply", "khala/*/blue/A/exchange"]
    assert rules["host"] == ["khala/*/**", "khala/*/**/@adv/**"]


async def heard(sender: ZenohBus, receiver: ZenohBus, awaited: Collection[str] = ()) -> set[str]:
    """Return which of the topics get from one to the other, when those awaited have.

    LOG has the lowest priority: on a busy machine, a question overtakes it.
    """
    asked = (receiver.subscribe(topic, Delivery.LOG) for topic in TOPICS)
    subscriptions = dict(zip(TOPICS, await asyncio.gather(*asked), strict=True))
    publishers = [await sender.publisher(topic, Delivery.LOG) for topic in TOPICS]
    await asyncio.gather(*(publisher.put(b"x") for publisher in publishers))
    arrived = [sample.key for topic in awaited for sample in await take(subscriptions[topic], 1)]
    for bus in (sender, receiver):  # a moment more, for those that should not get through
        await bus.subscribe("khala/r/run", Delivery.LOG)
    for subscription in subscriptions.values():
        await subscription.close()
    return {*arrived, *[sample.key for subscription in subscriptions.values() async for sample in subscription]}
