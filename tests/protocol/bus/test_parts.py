"""The parts of both buses, or of the one over Zenoh."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import TYPE_CHECKING

import pytest

from khala_protocol.bus import Liveness
from khala_protocol.bus.audience import Audience
from khala_protocol.bus.config import BATCH_BYTES
from khala_protocol.bus.inbox import Inbox
from khala_protocol.bus.keyexpr import matches
from khala_protocol.bus.lane import WINDOW_BYTES, DropGate, Lane, Shut, Window
from khala_protocol.bus.sightings import Sightings
from khala_protocol.bus.testing import take
from khala_protocol.bus.threads import run_detached

if TYPE_CHECKING:
    from collections.abc import Callable

# --- key expressions --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key_expr", "key", "expected"),
    [
        ("a", "a", True),
        ("a", "b", False),
        ("*", "a/b", False),
        ("**", "a", True),
        ("**/a", "a", True),
        ("a/**/b/**/c", "a/b/c", True),
        ("a/**/b/**/c", "a/x/b/y/z/c", True),
        ("a/**/b/**/c", "a/x/c", False),
        ("a/**/**", "a", True),
        ("a/*/**", "a", False),
    ],
)
def test_a_key_expression_matches_parts(key_expr: str, key: str, *, expected: bool) -> None:
    assert matches(key_expr, key) is expected


# --- mailbox ----------------------------------------------------------------------------------------


async def test_nothing_is_lost_between_threads_and_the_loop() -> None:
    mailbox: Inbox[tuple[int, int]] = Inbox(100_000)

    def offer(thread: int) -> None:
        for number in range(2_000):
            mailbox.offer_from_thread((thread, number))

    threads = [threading.Thread(target=offer, args=(thread,)) for thread in range(4)]
    for thread in threads:
        thread.start()
    items = await take(mailbox, 8_000)
    assert {thread: [n for t, n in items if t == thread] for thread in range(4)} == {
        thread: list(range(2_000)) for thread in range(4)
    }
    assert mailbox.dropped == 0


async def test_a_mailbox_that_nobody_empties_keeps_no_more_than_its_depth() -> None:
    mailbox: Inbox[int] = Inbox(3)
    for number in range(10):
        mailbox.offer_from_thread(number)
    await mailbox.close()
    assert [item async for item in mailbox] == [7, 8, 9]
    assert mailbox.dropped == 7


async def test_two_who_wait_on_a_mailbox_get_one_item_each() -> None:
    mailbox: Inbox[int] = Inbox(10)
    waiting = [asyncio.ensure_future(anext(mailbox)) for _ in range(2)]
    await asyncio.wait(waiting, timeout=0)
    mailbox.offer(1)
    mailbox.offer(2)
    assert sorted(await asyncio.gather(*waiting)) == [1, 2]


async def test_a_closed_mailbox_takes_nothing() -> None:
    closed: list[bool] = []
    mailbox: Inbox[int] = Inbox(10, on_close=lambda: closed.append(True))
    await mailbox.close()
    await mailbox.close()
    mailbox.offer(1)
    mailbox.offer_from_thread(2)
    assert [item async for item in mailbox] == []
    assert closed == [True]


def test_a_mailbox_outlives_its_loop() -> None:
    async def make() -> Inbox[int]:
        return Inbox(10)

    asyncio.run(make()).offer_from_thread(1)  # as a callback of Zenoh would, after the end


# --- lanes ------------------------------------------------------------------------------------------


class Inline(Executor):
    """An executor that counts its calls, and runs them at once."""

    def __init__(self) -> None:
        self.given = 0

    def submit(self, fn: Callable[..., float], /, *args: object, **kwargs: object) -> Future[float]:  # type: ignore[override]  # narrower is enough
        self.given += 1
        future: Future[float] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


class Peer:
    """A peer that takes puts and answers questions on demand."""

    def __init__(self) -> None:
        self.taken: list[bytes] = []
        self.questions: list[Callable[[bool], None]] = []

    def put(self, payload: bytes) -> None:
        self.taken.append(payload)


async def test_puts_stay_on_the_loop_while_what_is_under_way_fits_into_the_queue() -> None:
    peer, thread = Peer(), Inline()
    lane = Lane(thread, Window(peer.questions.append))
    for number in range(200):
        await lane.put(peer.put, b"%d" % number + bytes(2_000))
    assert thread.given == 0
    assert len(peer.questions) == 1  # one question serves many puts, and is asked once
    for _ in range(200):
        await lane.put(peer.put, bytes(2_000))
    assert thread.given == 400 - WINDOW_BYTES // 2_202
    peer.questions[0](True)
    before = thread.given
    await lane.put(peer.put, bytes(2_000))
    assert thread.given == before + 1  # what came after the question is still under way
    peer.questions[1](True)
    await lane.put(peer.put, bytes(2_000))
    assert thread.given == before + 1


async def test_without_an_answer_puts_leave_the_loop_and_it_is_asked_again() -> None:
    peer, thread = Peer(), Inline()
    lane = Lane(thread, Window(peer.questions.append))
    for _ in range(12):
        await lane.put(peer.put, bytes(60_000))
        if peer.questions:
            peer.questions[-1](False)
    assert thread.given == 12 - WINDOW_BYTES // 60_200
    assert len(peer.questions) > 3


async def test_what_is_larger_than_the_window_never_runs_on_the_loop() -> None:
    peer, thread = Peer(), Inline()
    await Lane(thread, Window(peer.questions.append)).put(peer.put, bytes(WINDOW_BYTES))
    await Lane(thread, Shut()).put(peer.put, b"")
    await Lane(thread, DropGate()).put(peer.put, bytes(BATCH_BYTES))
    assert thread.given == 3


async def test_a_put_whose_caller_was_cancelled_is_waited_for_before_its_publisher_goes() -> None:
    begun, goes_on, done = threading.Event(), threading.Event(), list[bytes]()

    def slow(payload: bytes) -> None:
        begun.set()
        goes_on.wait()
        done.append(payload)

    with ThreadPoolExecutor(1) as thread:
        lane = Lane(thread, Shut())
        caller = asyncio.create_task(lane.put(slow, b"1"))
        await asyncio.to_thread(begun.wait)
        caller.cancel()
        await asyncio.wait({caller})
        settled = asyncio.create_task(lane.settle())
        assert not (await asyncio.wait({settled}, timeout=0))[0]
        goes_on.set()
        await settled
        assert done == [b"1"]
    await lane.settle()


async def test_a_put_that_was_slow_sends_the_next_to_the_thread_until_one_is_quick() -> None:
    peer, thread = Peer(), Inline()
    gate = DropGate()
    lane = Lane(thread, gate)
    await lane.put(peer.put, b"1")
    assert thread.given == 0
    gate.sent(1, 0.02)
    await lane.put(peer.put, b"2")
    assert thread.given == 1
    await lane.put(peer.put, b"3")
    assert thread.given == 1


async def test_a_put_on_the_loop_does_not_overtake_one_that_waits_on_the_thread() -> None:
    release = threading.Event()
    taken: list[bytes] = []

    def put(payload: bytes) -> None:
        if payload == b"1" * BATCH_BYTES:
            release.wait(10)
        taken.append(payload[:1])

    with ThreadPoolExecutor(1) as thread:
        lane = Lane(thread, DropGate())
        first = asyncio.ensure_future(lane.put(put, b"1" * BATCH_BYTES))
        await asyncio.wait([first], timeout=0)
        second = asyncio.ensure_future(lane.put(put, b"2"))
        await asyncio.wait([second], timeout=0)
        release.set()
        await asyncio.gather(first, second)
    assert taken == [b"1", b"2"]


async def test_an_error_of_a_put_is_raised_where_it_was_given() -> None:
    def fail(_: bytes) -> None:
        raise OSError("no")

    with ThreadPoolExecutor(1) as thread:
        for gate in (DropGate(), Shut()):
            with pytest.raises(OSError, match="no"):
                await Lane(thread, gate).put(fail, b"")


# --- audience ---------------------------------------------------------------------------------------


class Router:
    """Answers when told to, and counts the questions."""

    def __init__(self) -> None:
        self.asked = 0
        self.answer = asyncio.Event()

    async def ask(self) -> None:
        self.asked += 1
        await self.answer.wait()


async def test_a_first_word_waits_until_the_router_has_told_who_listens() -> None:
    router = Router()
    audience = Audience(router.ask, once=True)
    waiting = asyncio.ensure_future(audience.wait())
    await asyncio.wait([waiting], timeout=0)
    assert not waiting.done()
    audience.see(present=True)
    router.answer.set()
    await waiting
    await audience.wait()
    assert router.asked == 1


@pytest.mark.parametrize(("once", "questions"), [(True, 1), (False, 3)])
async def test_if_nobody_listens_each_word_asks_or_only_the_first(once: bool, questions: int) -> None:
    router = Router()
    router.answer.set()
    audience = Audience(router.ask, once=once)
    for _ in range(3):
        await audience.wait()
    assert router.asked == questions
    audience.see(present=True)
    await audience.wait()
    assert router.asked == questions
    audience.see(present=False)  # they left, and may come back
    await audience.wait()
    assert router.asked == questions + 1


# --- sightings --------------------------------------------------------------------------------------


async def test_a_token_that_ends_with_our_link_blames_the_link() -> None:
    mailbox: Inbox[Liveness] = Inbox(10)
    sightings = Sightings(mailbox)
    sightings.token("a", alive=True)
    sightings.token("b", alive=True)
    sightings.token("a", alive=False)
    sightings.link(up=False)
    sightings.token("b", alive=False)
    sightings.link(up=True)
    sightings.token("a", alive=True)
    await mailbox.close()
    assert [report async for report in mailbox] == [
        Liveness("a", alive=True),
        Liveness("b", alive=True),
        Liveness("a", alive=False, link_up=False),
        Liveness("b", alive=False, link_up=False),
        Liveness("a", alive=True),
    ]


async def test_a_token_that_ends_alone_is_reported_after_a_moment_and_in_order() -> None:
    mailbox: Inbox[Liveness] = Inbox(10)
    sightings = Sightings(mailbox)
    sightings.token("a", alive=True)
    sightings.token("a", alive=False)
    sightings.token("a", alive=True)
    sightings.token("b", alive=True)
    assert await take(mailbox, 4) == [
        Liveness("a", alive=True),
        Liveness("a", alive=False, link_up=True),
        Liveness("a", alive=True),
        Liveness("b", alive=True),
    ]


async def test_what_is_known_is_not_reported_again() -> None:
    mailbox: Inbox[Liveness] = Inbox(10)
    sightings = Sightings(mailbox, patience_s=0)
    for alive in (False, True, True, False, False):
        sightings.token("a", alive=alive)
    await mailbox.close()
    assert [report.alive async for report in mailbox] == [True, False]


# --- detached threads -------------------------------------------------------------------------------


async def test_detached_work_returns_raises_and_can_be_given_up() -> None:
    assert await run_detached(lambda: 1) == 1
    with pytest.raises(ZeroDivisionError):
        await run_detached(lambda: 1 // 0)
    release = threading.Event()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.01):
            await run_detached(lambda: release.wait(10))
    release.set()
