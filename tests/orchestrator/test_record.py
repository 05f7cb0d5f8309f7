"""What is written down of a run, in which order, and when it is safe; on a clock that jumps."""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.publish.allowance import STEP_BYTES
from khala_orchestrator.publish.record import LAST_EXCHANGES_S, BestEffort, Listener, RecordingBus
from khala_orchestrator.roster import Seat
from khala_protocol.access import EXCHANGE_BYTES
from khala_protocol.bus import Delivery, Sample
from khala_protocol.codec import encode
from khala_protocol.errors import BusClosed, RecordingError
from khala_protocol.keys import Topic, agent_key, alive_key, every_agent, run_key
from khala_protocol.messages import ModelCall, Reply
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable
    from pathlib import Path

    from khala_protocol.bus.memory import MemoryBroker

CLOCK = "jumps"

RUN = "test"
REPLIES = every_agent(RUN, Topic.REPLY)
OBSERVATION = agent_key(RUN, "blue", "Stalkers", Topic.OBSERVATION)
REPLY = agent_key(RUN, "blue", "Stalkers", Topic.REPLY)
SEATS = [Seat("blue", "Stalkers")]
EXCHANGE = agent_key(RUN, "blue", "Stalkers", Topic.EXCHANGE)


def recorded(path: Path) -> list[tuple[str, bytes]]:
    return [(sample.key, sample.payload) for sample in Recording.open(path)]


async def test_what_is_sent_and_what_is_taken_stand_in_the_order_of_the_host(
    broker: MemoryBroker, tmp_path: Path
) -> None:
    agent = await broker.session().publisher(REPLY, Delivery.SPEECH)
    with Recorder(tmp_path / "run.mcap") as recorder:
        bus = RecordingBus(broker.session(), recorder, SEATS)
        publisher = await bus.publisher(OBSERVATION, Delivery.STATE)
        replies = await bus.subscribe(REPLIES, Delivery.SPEECH)
        await publisher.put(b"step 0")
        await agent.put(b"early")
        await agent.put(b"never taken")
        await publisher.put(b"step 1")
        assert await anext(replies) == Sample(REPLY, b"early")
        await publisher.put(b"step 2")
    assert recorded(tmp_path / "run.mcap") == [
        (OBSERVATION, b"step 0"),
        (OBSERVATION, b"step 1"),
        (REPLY, b"early"),
        (OBSERVATION, b"step 2"),
    ]


async def test_what_is_sent_arrives_as_without_a_recording(broker: MemoryBroker, tmp_path: Path) -> None:
    agent = await broker.session().subscribe(OBSERVATION, Delivery.STATE)
    with Recorder(tmp_path / "run.mcap") as recorder:
        publisher = await RecordingBus(broker.session(), recorder, SEATS).publisher(OBSERVATION, Delivery.STATE)
        assert publisher.key == OBSERVATION
        await publisher.put(b"step 0")
        assert (await anext(agent)).payload == b"step 0"
        late = await broker.session().subscribe(OBSERVATION, Delivery.STATE)
        assert (await anext(late)).payload == b"step 0"
        await publisher.close()
        with pytest.raises(BusClosed):
            await publisher.put(b"step 1")


async def test_it_is_recorded_before_it_is_sent(broker: MemoryBroker, tmp_path: Path) -> None:
    """What cannot be sent any more was meant to be, and stands in the file."""
    session = broker.session()
    with Recorder(tmp_path / "run.mcap") as recorder:
        publisher = await RecordingBus(session, recorder, SEATS).publisher(OBSERVATION, Delivery.STATE)
        session.kill()
        with pytest.raises(BusClosed):
            await publisher.put(b"last")
    assert recorded(tmp_path / "run.mcap") == [(OBSERVATION, b"last")]


async def test_bytes_that_are_no_message_are_kept_as_they_came(broker: MemoryBroker, tmp_path: Path) -> None:
    agent = await broker.session().publisher(REPLY, Delivery.SPEECH)
    with Recorder(tmp_path / "run.mcap") as recorder:
        replies = await RecordingBus(broker.session(), recorder, SEATS).subscribe(REPLIES, Delivery.SPEECH)
        await agent.put(b"\x00\xff garbage")
        await anext(replies)
    (sample,) = Recording.open(tmp_path / "run.mcap")
    assert (sample.payload, sample.message) == (b"\x00\xff garbage", None)


async def test_an_agent_cannot_fill_the_recording(
    broker: MemoryBroker, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "run.mcap"
    agent = await broker.session().publisher(EXCHANGE, Delivery.LOG)
    taken = []
    with Recorder(path) as recorder:
        bus = RecordingBus(broker.session(), recorder, [*SEATS, Seat("red", "Captain")])
        reports = await bus.publisher(run_key(RUN, Topic.REPORT), Delivery.LOG)
        for sent in (9, 1, 3):
            heard = await bus.subscribe(every_agent(RUN, Topic.EXCHANGE), Delivery.LOG)
            for _ in range(sent):
                await agent.put(bytes(STEP_BYTES))
            await heard.close()
            taken.append(len([sample async for sample in heard]))
            await reports.put(b"of one side of two: half a step")
    assert taken == [EXCHANGE_BYTES // STEP_BYTES, 0, 1]
    recording = Recording.open(path)
    assert recording.counts[EXCHANGE] == 5
    assert recording.left_out == {EXCHANGE: f"8 samples of {8 * STEP_BYTES} bytes"}
    assert [r.message for r in caplog.records] == [f"{EXCHANGE} sends more than 1 MB a step: the rest is left out"]


async def test_a_subscription_keeps_its_depth_and_says_what_it_lost(broker: MemoryBroker, tmp_path: Path) -> None:
    agent = await broker.session().publisher(OBSERVATION, Delivery.STATE)
    with Recorder(tmp_path / "run.mcap") as recorder:
        samples = await RecordingBus(broker.session(), recorder, SEATS).subscribe(OBSERVATION, Delivery.STATE, depth=1)
        await agent.put(b"0")
        await agent.put(b"1")
        assert (samples.dropped, samples.missed) == (1, 0)
        await samples.close()
        assert [sample.payload async for sample in samples] == [b"1"]
    assert recorded(tmp_path / "run.mcap") == [(OBSERVATION, b"1")]


async def test_it_says_how_many_samples_were_missed_while_the_link_was_down(
    broker: MemoryBroker, tmp_path: Path
) -> None:
    session = broker.session()
    agent = await broker.session().publisher(OBSERVATION, Delivery.STATE)
    with Recorder(tmp_path / "run.mcap") as recorder:
        samples = await RecordingBus(session, recorder, SEATS).subscribe(OBSERVATION, Delivery.STATE)
        await agent.put(b"0")
        session.cut()
        for payload in (b"1", b"2", b"3"):
            await agent.put(payload)
        session.mend()
        assert (samples.dropped, samples.missed) == (0, 2)


async def test_tokens_pass_through_and_are_not_recorded(broker: MemoryBroker, tmp_path: Path) -> None:
    key = alive_key(RUN, "blue", "Stalkers", "1")
    with Recorder(tmp_path / "run.mcap") as recorder:
        bus = RecordingBus(broker.session(), recorder, SEATS)
        others = await broker.session().watch(every_agent(RUN, Topic.ALIVE))
        own = await bus.watch(every_agent(RUN, Topic.ALIVE))
        token = await bus.announce(key)
        await token.close()
        for watcher in (others, own):
            assert [((seen := await anext(watcher)).key, seen.alive) for _ in range(2)] == [(key, True), (key, False)]
    assert recorded(tmp_path / "run.mcap") == []


async def test_closing_closes_the_bus_below_and_leaves_the_recorder(broker: MemoryBroker, tmp_path: Path) -> None:
    session = broker.session()
    with Recorder(tmp_path / "run.mcap") as recorder:
        await RecordingBus(session, recorder, SEATS).close()
        with pytest.raises(BusClosed):
            await session.publisher(OBSERVATION, Delivery.STATE)
        recorder.write(OBSERVATION, b"still open")
    assert recorded(tmp_path / "run.mcap") == [(OBSERVATION, b"still open")]


async def test_what_was_flushed_is_there_when_the_process_is_killed(broker: MemoryBroker, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run.mcap")
    publisher = await RecordingBus(broker.session(), recorder, SEATS).publisher(OBSERVATION, Delivery.STATE)
    await publisher.put(b"step 0")
    recorder.flush()
    await publisher.put(b"step 1")
    assert recorded(tmp_path / "run.mcap") == [(OBSERVATION, b"step 0")]
    assert not Recording.open(tmp_path / "run.mcap").complete
    recorder.close()
    assert recorded(tmp_path / "run.mcap") == [(OBSERVATION, b"step 0"), (OBSERVATION, b"step 1")]
    assert Recording.open(tmp_path / "run.mcap").complete


async def test_a_sample_that_cannot_be_recorded_is_not_sent(broker: MemoryBroker, tmp_path: Path) -> None:
    agent = await broker.session().subscribe(OBSERVATION, Delivery.STATE)
    with Recorder(tmp_path / "run.mcap") as recorder:
        publisher = await RecordingBus(broker.session(), recorder, SEATS).publisher(OBSERVATION, Delivery.STATE)
    with pytest.raises(RecordingError, match=r"run\.mcap was closed: open another recording to write more"):
        await publisher.put(b"after the end")
    await agent.close()
    assert [sample async for sample in agent] == []


async def test_a_listener_takes_what_agents_asked_their_models(broker: MemoryBroker, tmp_path: Path) -> None:
    agent = broker.session()
    with Recorder(tmp_path / "run.mcap") as recorder:
        bus = RecordingBus(broker.session(), recorder, SEATS)
        async with Listener(bus, RUN):
            await (await agent.publisher(EXCHANGE, Delivery.LOG)).put(asked())
            await (await agent.publisher(REPLY, Delivery.SPEECH)).put(said())
            await asyncio.sleep(0.001)
            recorder.flush()
            assert Recording.open(tmp_path / "run.mcap").counts == {EXCHANGE: 1}
    assert recorded(tmp_path / "run.mcap") == [(EXCHANGE, asked())]


async def test_a_listener_takes_what_had_arrived_before_it_ends(broker: MemoryBroker, tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap") as recorder:
        async with Listener(RecordingBus(broker.session(), recorder, SEATS), RUN):
            agent = await broker.session().publisher(EXCHANGE, Delivery.LOG)
            await agent.put(b"at the last moment")
        await agent.put(b"after the end")
    assert recorded(tmp_path / "run.mcap") == [(EXCHANGE, b"at the last moment")]


def asked(*, step: int = 0, **changes: Any) -> bytes:
    call = ModelCall(
        run=RUN, side="blue", agent="Stalkers", episode=0, step=step, attempt=1, model="m", endpoint="http://m/v1",
        prompt=(), completion="for Aiur", status="ok", started_s=0.0, latency_s=1.5,
    )  # fmt: skip
    return encode(call.but(**changes))


def said(*, step: int = 0, attempts: int = 1, **changes: Any) -> bytes:
    reply = Reply(run=RUN, side="blue", agent="Stalkers", episode=0, step=step, text="", attempts=attempts)
    return encode(reply.but(**changes))


@contextlib.asynccontextmanager
async def match(broker: MemoryBroker, path: Path) -> AsyncIterator[Callable[[bytes], Awaitable[None]]]:
    """Yield what sends a reply that the host takes; leaving it is the end of the match."""
    agent = await broker.session().publisher(REPLY, Delivery.SPEECH)
    with Recorder(path) as recorder:
        bus = RecordingBus(broker.session(), recorder, SEATS)
        async with Listener(bus, RUN):
            replies = await bus.subscribe(REPLIES, Delivery.SPEECH)

            async def send(payload: bytes) -> None:
                await agent.put(payload)
                await anext(replies)

            yield send


@pytest.mark.parametrize("late", [1, 2])
async def test_the_end_of_a_match_waits_for_exchanges_that_the_last_reply_announced(
    broker: MemoryBroker, tmp_path: Path, late: int
) -> None:
    exchanges = await broker.session().publisher(EXCHANGE, Delivery.LOG)
    loop = asyncio.get_running_loop()
    sending: list[asyncio.Task[None]] = []

    def send_later(payload: bytes) -> None:
        sending.append(asyncio.ensure_future(exchanges.put(payload)))

    async with match(broker, tmp_path / "run.mcap") as send:
        for attempt in range(1, 3 - late):
            await exchanges.put(asked(attempt=attempt))
        await send(said(attempts=2))
        for attempt in range(3 - late, 3):  # after the match has ended
            loop.call_later(0.0006 * attempt, send_later, asked(attempt=attempt))
        began = loop.time()
    assert loop.time() - began < LAST_EXCHANGES_S / 2
    calls = list(Recording.open(tmp_path / "run.mcap").of(ModelCall))
    assert [call.attempt for call in calls] == [1, 2]


@pytest.mark.parametrize(
    ("replies", "exchanges"),
    [
        ([said(attempts=0)], []),
        ([said()], [asked()]),
        ([said(step=0, attempts=2), said(step=1, attempts=1)], [asked(step=1)]),
        ([said(step=0), said(step=1)], []),  # a policy that counts what it asks and sends none
        ([said()], [asked(step=1)]),
        ([b"garbage", b"[]", b'{"episode": "x", "step": null}'], [b"garbage"]),
    ],
    ids=["nothing asked", "all there", "an older step", "never sent", "a later step", "no messages"],
)
async def test_it_does_not_wait_where_nothing_is_missing(
    broker: MemoryBroker, tmp_path: Path, replies: list[bytes], exchanges: list[bytes]
) -> None:
    agent = await broker.session().publisher(EXCHANGE, Delivery.LOG)
    loop = asyncio.get_running_loop()
    async with match(broker, tmp_path / "run.mcap") as send:
        for payload in exchanges:
            await agent.put(payload)
        for payload in replies:
            await send(payload)
        began = loop.time()
    assert loop.time() == began


async def test_it_waits_for_what_never_comes_only_so_long_and_not_at_all_after_an_error(
    broker: MemoryBroker, tmp_path: Path
) -> None:
    """A summary, or an exchange of an older step, is not what the reply announced."""
    agent = await broker.session().publisher(EXCHANGE, Delivery.LOG)
    loop = asyncio.get_running_loop()
    async with match(broker, tmp_path / "run.mcap") as send:
        await agent.put(asked(step=1))
        await agent.put(asked(step=2, purpose="summary"))
        await send(said(step=2))
        began = loop.time()
    assert loop.time() - began == pytest.approx(LAST_EXCHANGES_S)
    with contextlib.suppress(RuntimeError):
        async with match(broker, tmp_path / "other.mcap") as send:
            await send(said())
            began = loop.time()
            raise RuntimeError
    assert loop.time() == began


@pytest.mark.parametrize("changes", [{"agent": "Zealots"}, {"side": "red"}, {"run": "other"}])
async def test_words_in_the_mouth_of_another_agent_are_counted_and_not_recorded(
    broker: MemoryBroker, tmp_path: Path, changes: dict[str, Any]
) -> None:
    """The host hears of them, and calls the reply malformed."""
    exchanges = await broker.session().publisher(EXCHANGE, Delivery.LOG)
    async with match(broker, tmp_path / "run.mcap") as send:
        await send(said(**changes))
        await exchanges.put(asked(**changes))
        await exchanges.put(asked())
        await send(said())
    recording = Recording.open(tmp_path / "run.mcap")
    assert recording.counts == {EXCHANGE: 1, REPLY: 1}
    assert recording.left_out == dict.fromkeys((EXCHANGE, REPLY), "1 samples that name somebody else")


def test_a_match_may_go_on_without_its_recording(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    class FullDisk(Recorder):
        def write(self, key: str, payload: bytes, *, log_time_ns: int | None = None) -> None:
            raise RecordingError("no space left on device")

    with BestEffort(FullDisk(tmp_path / "run.mcap")) as recorder:
        for _ in range(2):
            recorder.write(OBSERVATION, b"")
            recorder.flush()
    assert caplog.messages == ["the match goes on without its recording: no space left on device"]
