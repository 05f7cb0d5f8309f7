"""The conformance tests of a bus: the promises of `khala_protocol.bus`, for pytest with asyncio mode `auto`.

A new implementation subclasses `BusConformance` in its test module, with a fixture `connect` that opens one more
session on the same bus and closes all of them at the end:

    class TestMyBus(BusConformance):
        @pytest.fixture
        async def connect(self) -> AsyncIterator[Connect]:
            ...

Nothing here sleeps. To know that something did *not* arrive, a test sends a last sample after it.
"""

# ruff: noqa: D102  a test's name is its docstring

from __future__ import annotations

import asyncio
import gc
import weakref
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any, TypeVar

import pytest

from khala_protocol.bus import Bus, Delivery, Liveness, Sample
from khala_protocol.errors import BusClosed, WrongKey

if TYPE_CHECKING:
    from khala_protocol.bus import Subscription

T = TypeVar("T")
Connect = Callable[[], Awaitable[Bus]]

WAIT_S = 10.0
"""Limit for a test that waits for something that never comes."""
LAST = b"last"
EVERY_DELIVERY = pytest.mark.parametrize("delivery", Delivery)


async def take(subscription: Subscription[T], count: int) -> list[T]:
    """Return the next `count` items."""
    async with asyncio.timeout(WAIT_S):
        return [await anext(subscription) for _ in range(count)]


async def take_until_last(subscription: Subscription[Sample]) -> list[Sample]:
    """Return the items before the one whose payload is `LAST`."""
    taken = []
    async with asyncio.timeout(WAIT_S):
        async for sample in subscription:
            if sample.payload == LAST:
                break
            taken.append(sample)
    return taken


class BusConformance:
    """The tests. They need a fixture `connect`, see the module's docstring."""

    # --- samples ------------------------------------------------------------------------------------

    @EVERY_DELIVERY
    async def test_samples_of_a_publisher_arrive_in_order_and_once(self, connect: Connect, delivery: Delivery) -> None:
        sender, receiver = await connect(), await connect()
        subscription = await receiver.subscribe("a/b", delivery)
        publisher = await sender.publisher("a/b", delivery)
        sent = [b"%d" % number for number in range(100)]
        for payload in [*sent, LAST]:
            await publisher.put(payload)
        assert [sample.payload for sample in await take_until_last(subscription)] == sent
        assert (subscription.dropped, subscription.missed) == (0, 0)

    async def test_speech_of_one_bus_arrives_in_order_whatever_its_keys(self, connect: Connect) -> None:
        sender, receiver = await connect(), await connect()
        subscription = await receiver.subscribe("**", Delivery.SPEECH)
        publishers = [await sender.publisher(f"agent/{name}", Delivery.SPEECH) for name in "abc"]
        sent = [Sample(publishers[n % 3].key, b"%d" % n * (1 + n * 977 % 9000)) for n in range(90)]
        for number, sample in enumerate(sent):
            await publishers[number % 3].put(sample.payload)
        assert await take(subscription, len(sent)) == sent

    async def test_messages_are_there_when_the_reply_behind_them_is(self, connect: Connect) -> None:
        agent, host = await connect(), await connect()
        messages = await host.subscribe("*/message", Delivery.SPEECH)
        replies = await host.subscribe("*/reply", Delivery.SPEECH)
        say = await agent.publisher("agent/message", Delivery.SPEECH)
        answer = await agent.publisher("agent/reply", Delivery.SPEECH)
        for turn in range(20):
            for _ in range(3):
                await say.put(b"%d" % turn)
            await answer.put(b"%d" % turn)
        for turn in range(20):
            await take(replies, 1)
            async with asyncio.timeout(0):  # they need no waiting
                assert [(await anext(messages)).payload for _ in range(3)] == [b"%d" % turn] * 3

    @pytest.mark.parametrize(
        ("key_expr", "matching"),
        [
            ("a/b", ["a/b"]),
            ("a/*", ["a/b", "a/c"]),
            ("*/b", ["a/b"]),
            ("*", ["a"]),
            ("a/**", ["a", "a/b", "a/c", "a/b/c"]),
            ("**/c", ["a/c", "a/b/c"]),
            ("a/**/c", ["a/c", "a/b/c"]),
            ("**", ["a", "a/b", "a/c", "a/b/c", "b/d"]),
            ("c/**", []),
        ],
    )
    async def test_wildcards_match_one_part_or_any_number(
        self, connect: Connect, key_expr: str, matching: list[str]
    ) -> None:
        sender, receiver = await connect(), await connect()
        subscription = await receiver.subscribe(key_expr, Delivery.SPEECH)
        last = await receiver.subscribe("z", Delivery.SPEECH)
        for key in ("a", "a/b", "a/c", "a/b/c", "b/d", "z"):
            await (await sender.publisher(key, Delivery.SPEECH)).put(key.encode())
        await take(last, 1)
        await receiver.close()
        assert [sample.key async for sample in subscription if sample.key != "z"] == matching

    @pytest.mark.parametrize("key", ["", "/a", "a/", "a//b", "a/*", "**", "a$b", "a?b", "a#b", "@a/b"])
    async def test_a_wrong_key_is_refused(self, connect: Connect, key: str) -> None:
        bus = await connect()
        with pytest.raises(WrongKey):
            await bus.publisher(key, Delivery.STATE)
        with pytest.raises(WrongKey):
            await bus.announce(key)

    @pytest.mark.parametrize("key_expr", ["", "/a", "a/", "a//b", "a*/b", "a/***", "a$b", "a?b", "@a/b"])
    async def test_a_wrong_key_expression_is_refused(self, connect: Connect, key_expr: str) -> None:
        bus = await connect()
        with pytest.raises(WrongKey):
            await bus.subscribe(key_expr, Delivery.STATE)
        with pytest.raises(WrongKey):
            await bus.watch(key_expr)

    @EVERY_DELIVERY
    @pytest.mark.parametrize("payload", [b"", bytes(range(256)) * 1200], ids=["nothing", "300 kB"])
    async def test_payloads_arrive_as_they_are(self, connect: Connect, delivery: Delivery, payload: bytes) -> None:
        sender, receiver = await connect(), await connect()
        subscription = await receiver.subscribe("a/b", delivery)
        await (await sender.publisher("a/b", delivery)).put(payload)
        assert await take(subscription, 1) == [Sample("a/b", payload)]

    @EVERY_DELIVERY
    async def test_a_session_hears_itself(self, connect: Connect, delivery: Delivery) -> None:
        bus = await connect()
        subscription = await bus.subscribe("a/*", delivery)
        await (await bus.publisher("a/b", delivery)).put(b"me")
        assert await take(subscription, 1) == [Sample("a/b", b"me")]

    @EVERY_DELIVERY
    async def test_a_put_right_after_subscribe_returned_arrives(self, connect: Connect, delivery: Delivery) -> None:
        sender, receiver = await connect(), await connect()
        for number in range(20):
            publisher = await sender.publisher(f"a/{number}", delivery)
            subscription = await receiver.subscribe(f"a/{number}", delivery)
            await publisher.put(b"first")
            assert await take(subscription, 1) == [Sample(f"a/{number}", b"first")]

    async def test_a_state_subscription_hears_every_delivery(self, connect: Connect) -> None:
        sender, recorder = await connect(), await connect()
        subscription = await recorder.subscribe("**", Delivery.STATE)
        for delivery in Delivery:
            await (await sender.publisher(delivery.value, delivery)).put(b"x")
        assert {sample.key for sample in await take(subscription, 3)} == {"state", "speech", "log"}

    # --- late joiners --------------------------------------------------------------------------------

    async def test_who_joins_late_gets_the_newest_state_at_once_and_goes_on_from_there(self, connect: Connect) -> None:
        host, witness, late = await connect(), await connect(), await connect()
        seen = await witness.subscribe("a/b", Delivery.STATE)
        publisher = await host.publisher("a/b", Delivery.STATE)
        for payload in (b"1", b"2", b"3"):
            await publisher.put(payload)
        await take(seen, 3)
        subscription = await late.subscribe("a/*", Delivery.STATE)
        assert await take(subscription, 1) == [Sample("a/b", b"3")]
        for payload in (b"4", b"5"):
            await publisher.put(payload)
        assert [sample.payload for sample in await take(subscription, 2)] == [b"4", b"5"]
        assert subscription.missed == 0

    async def test_who_joins_late_gets_the_newest_of_each_key(self, connect: Connect) -> None:
        host, late = await connect(), await connect()
        sent = [Sample(f"a/{name}", name.encode()) for name in "xyz"]
        for sample in sent:
            await (await host.publisher(sample.key, Delivery.STATE)).put(sample.payload)
        subscription = await late.subscribe("a/*", Delivery.STATE)
        assert sorted(await take(subscription, 3), key=lambda sample: sample.key) == sent

    async def test_a_state_that_was_put_before_anybody_listened_is_not_lost(self, connect: Connect) -> None:
        host, agent = await connect(), await connect()
        subscription = await agent.subscribe("a/b", Delivery.STATE)
        await (await host.publisher("a/b", Delivery.STATE)).put(b"1")
        assert await take(subscription, 1) == [Sample("a/b", b"1")]

    @pytest.mark.parametrize("delivery", [Delivery.SPEECH, Delivery.LOG])
    async def test_who_joins_late_hears_nothing_of_what_was_said(self, connect: Connect, delivery: Delivery) -> None:
        sender, witness, late = await connect(), await connect(), await connect()
        seen = await witness.subscribe("a/b", delivery)
        publisher = await sender.publisher("a/b", delivery)
        await publisher.put(b"before")
        await take(seen, 1)
        subscription = await late.subscribe("a/b", delivery)
        await publisher.put(b"after")
        assert await take(subscription, 1) == [Sample("a/b", b"after")]

    async def test_a_closed_publisher_leaves_no_state_behind(self, connect: Connect) -> None:
        host, witness, late = await connect(), await connect(), await connect()
        seen = await witness.subscribe("a/b", Delivery.STATE)
        publisher = await host.publisher("a/b", Delivery.STATE)
        await publisher.put(b"old")
        await take(seen, 1)  # it has left the link
        await publisher.close()
        await publisher.close()
        await (await host.publisher("a/c", Delivery.STATE)).put(LAST)
        assert await take_until_last(await late.subscribe("a/*", Delivery.STATE)) == []

    async def test_the_state_of_a_publisher_that_came_back_arrives(self, connect: Connect) -> None:
        first, receiver = await connect(), await connect()
        subscription = await receiver.subscribe("a/b", Delivery.STATE)
        await (await first.publisher("a/b", Delivery.STATE)).put(b"first life")
        await take(subscription, 1)
        await first.close()
        second = await connect()
        await (await second.publisher("a/b", Delivery.STATE)).put(b"second life")
        assert await take(subscription, 1) == [Sample("a/b", b"second life")]

    # --- slow receivers ------------------------------------------------------------------------------

    @EVERY_DELIVERY
    @pytest.mark.parametrize("depth", [1, 3])
    async def test_who_is_slow_keeps_the_newest_and_is_told_how_many_were_dropped(
        self, connect: Connect, delivery: Delivery, depth: int
    ) -> None:
        sender, receiver = await connect(), await connect()
        slow = await receiver.subscribe("a/b", delivery, depth=depth)
        other = await receiver.subscribe("a/**", delivery)
        publisher, last = await sender.publisher("a/b", delivery), await sender.publisher("a/c", delivery)
        sent = [b"%d" % number for number in range(10)]
        for payload in sent:
            await publisher.put(payload)
        await last.put(LAST)
        assert [sample.payload for sample in await take_until_last(other)] == sent
        assert [sample.payload for sample in await take(slow, depth)] == sent[-depth:]
        assert (slow.dropped, other.dropped) == (10 - depth, 0)

    async def test_a_wait_that_is_given_up_loses_nothing(self, connect: Connect) -> None:
        sender, receiver = await connect(), await connect()
        subscription = await receiver.subscribe("a/b", Delivery.SPEECH)
        waiting = asyncio.ensure_future(anext(subscription))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0):
                await waiting
        await (await sender.publisher("a/b", Delivery.SPEECH)).put(b"x")
        assert await take(subscription, 1) == [Sample("a/b", b"x")]

    async def test_a_depth_of_nothing_is_refused(self, connect: Connect) -> None:
        bus = await connect()
        with pytest.raises(ValueError, match="depth must be at least 1, not 0"):
            await bus.subscribe("a/b", Delivery.STATE, depth=0)

    # --- the end ------------------------------------------------------------------------------------

    @EVERY_DELIVERY
    async def test_closing_a_subscription_ends_its_iteration_and_no_other(
        self, connect: Connect, delivery: Delivery
    ) -> None:
        sender, receiver = await connect(), await connect()
        closing = await receiver.subscribe("a/b", delivery)
        staying = await receiver.subscribe("a/b", delivery)
        waiting = asyncio.ensure_future(anext(closing, None))
        await closing.close()
        await closing.close()
        async with asyncio.timeout(WAIT_S):
            assert await waiting is None
        await (await sender.publisher("a/b", delivery)).put(b"x")
        assert await take(staying, 1) == [Sample("a/b", b"x")]
        assert [sample async for sample in closing] == []

    @EVERY_DELIVERY
    async def test_a_closed_subscription_is_not_kept_in_memory(self, connect: Connect, delivery: Delivery) -> None:
        bus = await connect()
        subscription = await bus.subscribe("a/b", delivery)
        watch = await bus.watch("a/b")
        traces: list[weakref.ref[Subscription[Any]]] = [weakref.ref(subscription), weakref.ref(watch)]
        await subscription.close()
        await watch.close()
        del subscription, watch
        gc.collect()
        assert [trace() for trace in traces] == [None, None]

    async def test_closing_the_bus_ends_every_iteration(self, connect: Connect) -> None:
        bus = await connect()
        subscriptions = [await bus.subscribe("a/b", delivery) for delivery in Delivery]
        waiting = [asyncio.ensure_future(anext(subscription, None)) for subscription in subscriptions]
        watching = asyncio.ensure_future(anext(await bus.watch("a/b"), None))
        async with asyncio.timeout(2):
            await bus.close()
            await bus.close()
        async with asyncio.timeout(WAIT_S):
            assert await asyncio.gather(*waiting, watching) == [None] * 4

    async def test_what_arrived_before_the_end_is_still_handed_out(self, connect: Connect) -> None:
        sender, receiver = await connect(), await connect()
        subscription = await receiver.subscribe("a/b", Delivery.SPEECH)
        last = await receiver.subscribe("a/c", Delivery.SPEECH)
        for key, payload in (("a/b", b"1"), ("a/b", b"2"), ("a/c", LAST)):
            await (await sender.publisher(key, Delivery.SPEECH)).put(payload)
        await take(last, 1)
        await receiver.close()
        assert [sample.payload async for sample in subscription] == [b"1", b"2"]

    @EVERY_DELIVERY
    async def test_what_was_put_before_the_sender_closed_arrives(self, connect: Connect, delivery: Delivery) -> None:
        sender, receiver = await connect(), await connect()
        subscription = await receiver.subscribe("a/b", delivery)
        publisher = await sender.publisher("a/b", delivery)
        sent = [bytes([number]) * 20_000 for number in range(10)]
        for payload in sent:
            await publisher.put(payload)
        await sender.close()
        assert [sample.payload for sample in await take(subscription, 10)] == sent

    async def test_a_closed_bus_refuses_everything(self, connect: Connect) -> None:
        bus = await connect()
        publishers = [await bus.publisher("a/b", delivery) for delivery in Delivery]
        token = await bus.announce("a/t")
        await bus.close()
        for publisher in publishers:
            with pytest.raises(BusClosed):
                await publisher.put(b"x")
            await publisher.close()
        await token.close()
        for attempt in (
            bus.publisher("a/b", Delivery.STATE),
            bus.subscribe("a/b", Delivery.STATE),
            bus.announce("a/b"),
            bus.watch("a/b"),
        ):
            with pytest.raises(BusClosed):
                await attempt

    async def test_a_closed_publisher_refuses_to_put(self, connect: Connect) -> None:
        bus = await connect()
        for delivery in Delivery:
            publisher = await bus.publisher("a/b", delivery)
            assert publisher.key == "a/b"
            await publisher.close()
            with pytest.raises(BusClosed):
                await publisher.put(b"x")

    async def test_closing_one_session_leaves_the_others_alone(self, connect: Connect) -> None:
        leaving, listening, speaking = await connect(), await connect(), await connect()
        subscription = await listening.subscribe("a/b", Delivery.SPEECH)
        publisher = await speaking.publisher("a/b", Delivery.SPEECH)
        await leaving.close()
        await publisher.put(b"x")
        assert await take(subscription, 1) == [Sample("a/b", b"x")]

    # --- liveliness ----------------------------------------------------------------------------------

    async def test_a_watch_reports_who_is_there_and_then_who_comes_and_goes(self, connect: Connect) -> None:
        host, early, late = await connect(), await connect(), await connect()
        tokens = [await early.announce(key) for key in ("a/alive/1", "b/alive/1")]
        elsewhere = await host.watch("**")
        await take(elsewhere, 2)
        watch = await host.watch("*/alive/*")
        assert set(await take(watch, 2)) == {Liveness("a/alive/1", alive=True), Liveness("b/alive/1", alive=True)}
        await late.announce("a/alive/2")
        assert await take(watch, 1) == [Liveness("a/alive/2", alive=True)]
        await tokens[0].close()
        await tokens[0].close()
        assert await take(watch, 1) == [Liveness("a/alive/1", alive=False)]
        await late.close()
        assert await take(watch, 1) == [Liveness("a/alive/2", alive=False)]

    async def test_a_session_that_closes_takes_its_tokens_along(self, connect: Connect) -> None:
        host, agents = await connect(), await connect()
        watch = await host.watch("alive/*")
        keys = {f"alive/{number}" for number in range(8)}
        for key in keys:
            await agents.announce(key)
        assert {report.key for report in await take(watch, 8)} == keys
        await agents.close()
        assert set(await take(watch, 8)) == {Liveness(key, alive=False, link_up=True) for key in keys}

    async def test_a_token_comes_back_under_the_same_key(self, connect: Connect) -> None:
        host, first, second = await connect(), await connect(), await connect()
        watch = await host.watch("alive/*")
        await first.announce("alive/a")
        await take(watch, 1)
        await first.close()
        assert await take(watch, 1) == [Liveness("alive/a", alive=False)]
        await second.announce("alive/a")
        assert await take(watch, 1) == [Liveness("alive/a", alive=True)]

    async def test_two_tokens_of_one_key_look_like_one_until_both_are_gone(self, connect: Connect) -> None:
        host, first, second = await connect(), await connect(), await connect()
        watch = await host.watch("alive/*")
        tokens = [await session.announce("alive/a") for session in (first, second)]
        await second.announce("alive/b")  # what it announced before is known then
        assert {report.key for report in await take(watch, 2)} == {"alive/a", "alive/b"}
        await tokens[0].close()
        await second.announce("alive/c")
        assert await take(watch, 1) == [Liveness("alive/c", alive=True)]
        await tokens[1].close()
        assert await take(watch, 1) == [Liveness("alive/a", alive=False)]

    async def test_tokens_are_no_samples_and_samples_no_tokens(self, connect: Connect) -> None:
        listening, speaking = await connect(), await connect()
        subscription, watch = await listening.subscribe("**", Delivery.STATE), await listening.watch("**")
        await speaking.announce("a/token")
        await (await speaking.publisher("a/state", Delivery.STATE)).put(b"x")
        await (await speaking.publisher("a/speech", Delivery.SPEECH)).put(b"y")
        assert {sample.key for sample in await take(subscription, 2)} == {"a/state", "a/speech"}
        await speaking.announce("a/token/2")
        assert {report.key for report in await take(watch, 2)} == {"a/token", "a/token/2"}
