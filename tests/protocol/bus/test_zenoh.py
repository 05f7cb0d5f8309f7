"""Behaviour that needs processes, links and a router."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import logging
import os
import signal
import time
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

from khala_protocol.bus import Delivery, Liveness, Sample
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.inbox import Inbox
from khala_protocol.bus.testing import take
from khala_protocol.bus.zenoh import probe

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from .conftest import OpenBus, StartPeer

LOCAL = BusConfig(mode="router", listen=("tcp/127.0.0.1:0",))


class Gap:
    """The longest time between two turns of the loop, in seconds."""

    def __init__(self) -> None:
        self.worst_s = 0.0


@asynccontextmanager
async def watching_the_loop() -> AsyncIterator[Gap]:
    loop, gap = asyncio.get_running_loop(), Gap()
    last, handle = loop.time(), loop.call_soon(lambda: None)

    def tick() -> None:
        nonlocal last, handle
        now = loop.time()
        gap.worst_s, last = max(gap.worst_s, now - last), now
        handle = loop.call_later(0.002, tick)

    tick()
    yield gap
    tick()
    handle.cancel()


# --- processes that die, hang and forget ------------------------------------------------------------


async def test_a_killed_process_is_gone_at_once(opened: OpenBus, start: StartPeer) -> None:
    host = await opened(LOCAL)
    watch = await host.watch("*/alive")
    agent = await start("agent", host.endpoints[0])
    assert await take(watch, 1) == [Liveness("agent/alive", alive=True)]
    agent.kill()
    killed = time.perf_counter()
    assert await take(watch, 1) == [Liveness("agent/alive", alive=False)]
    assert time.perf_counter() - killed < 0.5


@pytest.mark.posix
@pytest.mark.parametrize("size", [20_000, 300_000])
async def test_a_stopped_agent_slows_nobody_and_has_the_newest_when_it_goes_on(
    opened: OpenBus, start: StartPeer, size: int
) -> None:
    host = await opened(LOCAL)
    replies = await host.subscribe("agent/reply", Delivery.SPEECH)
    healthy = await (await opened(BusConfig(connect=host.endpoints))).subscribe("healthy", Delivery.STATE)
    agent = await start("agent", host.endpoints[0])
    to_agent = await host.publisher("agent/observation", Delivery.STATE)
    to_healthy = await host.publisher("healthy", Delivery.STATE)
    os.kill(agent.pid, signal.SIGSTOP)
    waits_s, number = [], 0
    async with watching_the_loop() as gap:
        for number in range(20_000_000 // size):  # more than the buffers between them hold
            payload = number.to_bytes(8) + bytes(size)
            before = time.perf_counter()
            await asyncio.gather(to_agent.put(payload), to_healthy.put(payload))
            assert await take(healthy, 1) == [Sample("healthy", payload)]
            waits_s.append(time.perf_counter() - before)
    os.kill(agent.pid, signal.SIGCONT)
    newest = b""
    while newest != number.to_bytes(8):
        newest = (await take(replies, 1))[0].payload
    assert max(waits_s) < 0.5
    assert gap.worst_s < 0.4
    assert healthy.missed == 0


@pytest.mark.posix
async def test_speech_to_a_stopped_router_holds_neither_the_loop_nor_the_end(
    opened: OpenBus, start: StartPeer, socket: str
) -> None:
    router = await start("router", socket)
    agent, listener = await opened(BusConfig(connect=(socket,))), await opened(BusConfig(connect=(socket,)))
    await listener.subscribe("reply", Delivery.SPEECH)
    publisher = await agent.publisher("reply", Delivery.SPEECH)
    await publisher.put(b"first")
    os.kill(router.pid, signal.SIGSTOP)
    before = time.perf_counter()
    async with watching_the_loop() as gap:
        for _ in range(400):
            await publisher.put(bytes(20_000))
    took_s = time.perf_counter() - before
    assert 0.4 < took_s < 3  # half a second for the first that blocks; it closes the link
    assert gap.worst_s < 0.4
    async with asyncio.timeout(2):
        await agent.close()


@pytest.mark.posix
async def test_speech_that_waits_for_its_link_arrives_although_the_sender_closes(
    opened: OpenBus, start: StartPeer, socket: str
) -> None:
    router = await start("router", socket)
    agent, listener = await opened(BusConfig(connect=(socket,))), await opened(BusConfig(connect=(socket,)))
    replies = await listener.subscribe("reply", Delivery.SPEECH)
    publisher = await agent.publisher("reply", Delivery.SPEECH)
    sent = [bytes([number]) * 20_000 for number in range(30)]  # more than fits into the kernel's buffers
    await publisher.put(b"first")
    os.kill(router.pid, signal.SIGSTOP)
    asyncio.get_running_loop().call_later(0.3, os.kill, router.pid, signal.SIGCONT)
    for payload in sent:
        await publisher.put(payload)
    await agent.close()
    assert [sample.payload for sample in await take(replies, 31)] == [b"first", *sent]


async def test_publishers_close_at_once_while_clients_leave(opened: OpenBus, socket: str) -> None:
    host = await opened(BusConfig(mode="router", listen=(socket,)))
    for _ in range(4):
        clients = [await opened(BusConfig(connect=(socket,))) for _ in range(3)]
        states = [await host.publisher(f"state/{one}", Delivery.STATE) for one in range(4)]
        logs = [await host.publisher(f"log/{one}", Delivery.LOG) for one in range(10)]  # who listens comes in callbacks
        for client in clients:
            await client.subscribe("log/**", Delivery.LOG)
        leaving = [asyncio.create_task(client.close()) for client in clients]
        async with watching_the_loop() as gap:
            for publisher in (*states, *logs):
                await asyncio.sleep(0)
                await publisher.close()
            await asyncio.wait(leaving)
        assert gap.worst_s < 2  # Zenoh's own `undeclare` took 10 s each in most of such rounds


async def test_a_process_that_forgets_to_close_ends_all_the_same(opened: OpenBus, start: StartPeer) -> None:
    router = await opened(LOCAL)
    process = await start("forgetful", router.endpoints[0])
    async with asyncio.timeout(5):
        assert await process.wait() == 0


# --- links that break -------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["SIGKILL", "SIGTERM"])
async def test_after_a_restart_of_the_router_the_newest_state_arrives_and_nobody_was_blamed(
    opened: OpenBus, start: StartPeer, socket: str, end: str
) -> None:
    router = await start("router", socket)
    host, agent = await opened(BusConfig(connect=(socket,))), await opened(BusConfig(connect=(socket,)))
    publisher = await host.publisher("observation", Delivery.STATE)
    observations = await agent.subscribe("observation", Delivery.STATE)
    watch = await host.watch("*/alive")
    for name in "abc":
        await agent.announce(f"{name}/alive")
    await publisher.put(b"1")
    assert await take(observations, 1) == [Sample("observation", b"1")]
    assert all(report.alive for report in await take(watch, 3))

    router.send_signal(signal.Signals[end])
    await router.wait()
    gone = await take(watch, 3)
    for payload in (b"2", b"3"):
        await publisher.put(payload)
    await start("router", socket)  # the socket that the killed one left behind is no obstacle

    back = await take(watch, 3)
    assert {(report.key, report.alive, report.link_up) for report in gone} == {
        (f"{name}/alive", False, False) for name in "abc"
    }
    assert {report.key for report in back if report.alive} == {"a/alive", "b/alive", "c/alive"}
    newest = (await take(observations, 1))[0]
    assert newest == Sample("observation", b"3")
    await publisher.put(b"4")
    assert await take(observations, 1) == [Sample("observation", b"4")]


async def test_a_client_waits_for_a_router_that_comes_up_later(opened: OpenBus, socket: str) -> None:
    client = asyncio.ensure_future(opened(BusConfig(connect=(socket,))))
    done, _ = await asyncio.wait([client], timeout=0.02)
    assert not done
    router = await opened(BusConfig(mode="router", listen=(socket,)))
    async with asyncio.timeout(5):
        assert (await client).routers == (router.identity,)


# --- the session ------------------------------------------------------------------------------------


async def test_endpoints_tell_the_port_that_was_taken(opened: OpenBus, socket: str) -> None:
    router = await opened(BusConfig(mode="router", listen=("tcp/127.0.0.1:0", socket)))
    tcp, unix = sorted(router.endpoints)
    assert unix == socket
    assert int(tcp.removeprefix("tcp/127.0.0.1:")) > 0
    for endpoint in router.endpoints:
        client = await opened(BusConfig(connect=(endpoint,)))
        assert client.endpoints == (endpoint,)


async def test_a_probe_tells_which_router_answers(opened: OpenBus, socket: str) -> None:
    router = await opened(BusConfig(mode="router", listen=(socket,)))
    assert await probe(BusConfig(connect=(socket,))) == (router.identity,)


async def test_cancelling_an_open_leaves_nothing_behind(socket: str, opened: OpenBus) -> None:
    opening = asyncio.ensure_future(opened(BusConfig(connect=(socket,), connect_timeout_s=0.3)))
    await asyncio.wait([opening], timeout=0.02)
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    await (await opened(BusConfig(mode="router", listen=(socket,)))).close()


async def test_cancelling_a_subscribe_leaves_nothing_behind(opened: OpenBus) -> None:
    def mailboxes() -> int:
        gc.collect()
        return sum(isinstance(thing, Inbox) for thing in gc.get_objects())

    bus, before = await opened(LOCAL), mailboxes()
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(0):
            await bus.subscribe("a/b", Delivery.SPEECH)
            pytest.fail("it was not cancelled")
    await (await bus.subscribe("a/b", Delivery.SPEECH)).close()  # by then, Zenoh has released the first
    assert mailboxes() == before


async def test_what_is_published_stays_although_nobody_keeps_the_publisher(opened: OpenBus, socket: str) -> None:
    await opened(BusConfig(mode="router", listen=(socket,)))
    host, late = await opened(BusConfig(connect=(socket,))), await opened(BusConfig(connect=(socket,)))
    await (await host.publisher("a/b", Delivery.STATE)).put(b"x")
    await host.announce("a/alive")
    gc.collect()
    assert await take(await late.subscribe("a/b", Delivery.STATE), 1) == [Sample("a/b", b"x")]
    assert await take(await late.watch("a/alive"), 1) == [Liveness("a/alive", alive=True)]


async def test_an_error_in_a_callback_is_logged_and_the_subscription_lives_on(
    opened: OpenBus, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bus = await opened(LOCAL)
    subscription = await bus.subscribe("a/b", Delivery.SPEECH)
    publisher = await bus.publisher("a/b", Delivery.SPEECH)
    with monkeypatch.context() as broken, caplog.at_level(logging.ERROR, "zenoh.handlers"):
        broken.setattr(Inbox, "offer_from_thread", lambda *_: 1 / 0)
        await publisher.put(b"lost")
    await publisher.put(b"kept")
    assert await take(subscription, 1) == [Sample("a/b", b"kept")]
    assert "division by zero" in caplog.text
