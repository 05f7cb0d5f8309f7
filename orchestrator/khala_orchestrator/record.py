"""Record every topic of a run: a bus that records what passes through it.

The host records what it sends before it is sent, and what it gets when it takes it. So the file holds the order in
which the host acted, and congestion cannot remove what the host saw. Below it: a bus and a
`khala_protocol.recording.Recorder`. Above it: `khala_orchestrator.host`, which passes the recording bus to everything
else.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from typing import TYPE_CHECKING, Protocol, Self

from khala_orchestrator.allowance import Allowance
from khala_orchestrator.roster import Seat
from khala_protocol.bus import Bus, Delivery, Liveness, Publisher, Sample, Subscription, Token
from khala_protocol.errors import RecordingError, WrongKey
from khala_protocol.keys import Topic, every_agent, parse

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterable, Iterator
    from types import TracebackType

    from khala_protocol.recording import Recorder

log = logging.getLogger(__name__)


class Sink(Protocol):
    """Where a recording is written to."""

    def write(self, key: str, payload: bytes, *, log_time_ns: int | None = None) -> None:
        """Write one sample."""

    def flush(self) -> None:
        """Keep what was written from being lost."""

    def note_left_out(self, key: str, words: str) -> None:
        """Keep how much of a key is not written; the last words count."""


class OwnedSink(Sink, Protocol):
    """A sink that is closed by leaving it."""

    def __enter__(self) -> Self:
        """Return itself."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""


class BestEffort:
    """A recorder that gives up when it cannot write, for matches that are worth more than their recordings.

    A context manager around the recorder, which it closes.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._lost = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._giving_up():
            self._recorder.close()

    def write(self, key: str, payload: bytes, *, log_time_ns: int | None = None) -> None:
        """Write one sample, as long as that is possible."""
        if not self._lost:
            with self._giving_up():
                self._recorder.write(key, payload, log_time_ns=log_time_ns)

    def flush(self) -> None:
        """Flush the recording, as long as that is possible."""
        if not self._lost:
            with self._giving_up():
                self._recorder.flush()

    def note_left_out(self, key: str, words: str) -> None:
        """Keep how much of a key is not written."""
        self._recorder.note_left_out(key, words)

    @contextlib.contextmanager
    def _giving_up(self) -> Iterator[None]:
        try:
            yield
        except RecordingError as error:
            if not self._lost:
                log.warning("the match goes on without its recording: %s", error)
            self._lost = True


class RecordingBus:
    """A `Bus` that records every sample it publishes or hands out.

    Samples under keys of agents that are not in the match are handed out and not recorded: a recording has room for
    65 535 keys, and anybody who may write can make up more. What an agent sends beyond its `Allowance` is neither: the
    host does not act on what is not in the file. The metadata of the recording say how much was left out.
    """

    def __init__(self, bus: Bus, recorder: Sink, seats: Iterable[Seat]) -> None:
        self._bus = bus
        self._recorder = recorder
        self._seats = frozenset(seats)
        self._allowance = Allowance(reports=len({seat.side for seat in self._seats}) or 1)

    async def publisher(self, key: str, delivery: Delivery) -> Publisher:
        """Declare a publisher whose samples are recorded before they are sent."""
        ends_step = self._allowance.report if key.endswith(f"/{Topic.REPORT}") else None
        return _RecordingPublisher(await self._bus.publisher(key, delivery), self._recorder, ends_step)

    async def subscribe(self, key_expr: str, delivery: Delivery, *, depth: int = 1024) -> Subscription[Sample]:
        """Declare a subscription whose samples are recorded when they are taken."""
        subscription = await self._bus.subscribe(key_expr, delivery, depth=depth)
        return _RecordingSubscription(subscription, self._recorder, self._is_known, self._has_room)

    async def announce(self, key: str) -> Token:
        """Declare a liveliness token; tokens are not recorded, reports say who was there."""
        return await self._bus.announce(key)

    async def watch(self, key_expr: str, *, depth: int = 1024) -> Subscription[Liveness]:
        """Report tokens."""
        return await self._bus.watch(key_expr, depth=depth)

    def _is_known(self, key: str) -> bool:
        try:
            address = parse(key)
        except WrongKey:
            return False
        return address.agent is None or address.side is None or Seat(address.side, address.agent) in self._seats

    def _has_room(self, sample: Sample) -> bool:
        room = self._allowance.takes(sample.key, len(sample.payload))
        if not room:
            self._recorder.note_left_out(sample.key, self._allowance.left_out(sample.key))
        return room

    async def close(self) -> None:
        """Close the bus below; the owner of the recorder closes it."""
        await self._bus.close()


class Listener:
    """A subscription to topics that the host itself does not need, so that they are recorded. A context manager."""

    def __init__(self, bus: Bus, run: str) -> None:
        self._bus = bus
        self._run = run
        self._subscription: Subscription[Sample] | None = None
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        self._subscription = await self._bus.subscribe(every_agent(self._run, Topic.EXCHANGE), Delivery.LOG)
        self._task = asyncio.create_task(_drain(self._subscription), name="record exchanges")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._subscription is not None and self._task is not None
        await self._subscription.close()
        await self._task


class _RecordingPublisher:
    def __init__(self, publisher: Publisher, recorder: Sink, ends_step: Callable[[], None] | None) -> None:
        self._publisher = publisher
        self._recorder = recorder
        self._ends_step = ends_step

    @property
    def key(self) -> str:
        return self._publisher.key

    async def put(self, payload: bytes) -> None:
        self._recorder.write(self._publisher.key, payload)
        if self._ends_step:
            self._ends_step()
        await self._publisher.put(payload)

    async def close(self) -> None:
        await self._publisher.close()


class _RecordingSubscription:
    def __init__(
        self,
        subscription: Subscription[Sample],
        recorder: Sink,
        is_known: Callable[[str], bool],
        has_room: Callable[[Sample], bool],
    ) -> None:
        self._subscription = subscription
        self._recorder = recorder
        self._is_known = is_known
        self._has_room = has_room

    @property
    def dropped(self) -> int:
        return self._subscription.dropped

    @property
    def missed(self) -> int:
        return self._subscription.missed

    def __aiter__(self) -> AsyncIterator[Sample]:
        return self

    async def __anext__(self) -> Sample:
        async for sample in self._subscription:
            if not self._is_known(sample.key):
                return sample
            if self._has_room(sample):
                self._recorder.write(sample.key, sample.payload)
                return sample
        raise StopAsyncIteration

    async def close(self) -> None:
        await self._subscription.close()


async def _drain(samples: Subscription[Sample]) -> None:
    async for _ in samples:
        pass
