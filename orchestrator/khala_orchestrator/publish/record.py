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
from collections import Counter
from typing import TYPE_CHECKING, Any, Protocol, Self

from pydantic_core import from_json

from khala_orchestrator.publish.allowance import Allowance
from khala_orchestrator.roster import Seat
from khala_protocol.bus import Bus, Delivery, Liveness, Publisher, Sample, Subscription, Token
from khala_protocol.errors import RecordingError, WrongKey
from khala_protocol.keys import Topic, every_agent, parse
from khala_protocol.recording.speaker import fits

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterable, Iterator
    from types import TracebackType

    from khala_protocol.keys import Address
    from khala_protocol.recording import Recorder

log = logging.getLogger(__name__)

LAST_EXCHANGES_S = 1.0
"""How long the end of a match waits for exchanges that replies have announced: an agent that died sends none."""


_Step = tuple[int, int]


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
    host does not act on what is not in the file. A sample that names somebody else than its key is handed out, so that
    it is counted as malformed, and not recorded. The metadata of the recording say how much was left out.

    Attributes:
        exchanges: which ones were announced and have arrived.
    """

    def __init__(self, bus: Bus, recorder: Sink, seats: Iterable[Seat]) -> None:
        self._bus = bus
        self._recorder = recorder
        self._seats = frozenset(seats)
        self._allowance = Allowance(reports=len({seat.side for seat in self._seats}) or 1)
        self._foreign = Counter[str]()
        self.exchanges = Exchanges()

    async def publisher(self, key: str, delivery: Delivery) -> Publisher:
        """Declare a publisher whose samples are recorded before they are sent."""
        ends_step = self._allowance.report if key.endswith(f"/{Topic.REPORT}") else None
        return _RecordingPublisher(await self._bus.publisher(key, delivery), self._recorder, ends_step)

    async def subscribe(self, key_expr: str, delivery: Delivery, *, depth: int = 1024) -> Subscription[Sample]:
        """Declare a subscription whose samples are recorded when they are taken."""
        subscription = await self._bus.subscribe(key_expr, delivery, depth=depth)
        return _RecordingSubscription(subscription, self._take)

    async def announce(self, key: str) -> Token:
        """Declare a liveliness token; tokens are not recorded, reports say who was there."""
        return await self._bus.announce(key)

    async def watch(self, key_expr: str, *, depth: int = 1024) -> Subscription[Liveness]:
        """Report tokens."""
        return await self._bus.watch(key_expr, depth=depth)

    def _take(self, sample: Sample) -> bool:
        """Record a sample of an agent of the match, and return whether it is handed out."""
        address = self._known(sample.key)
        if address is None:
            return True
        said = _fields(sample.payload)
        if not fits(address, *map(said.get, ("run", "side", "agent"))):
            self._foreign[sample.key] += 1
            self._note_left_out(sample.key)
            return True
        if not self._allowance.takes(sample.key, len(sample.payload)):
            self._note_left_out(sample.key)
            return False
        self._recorder.write(sample.key, sample.payload)
        self.exchanges.take(address, said)
        return True

    def _known(self, key: str) -> Address | None:
        try:
            address = parse(key)
        except WrongKey:
            return None
        of_agent = address.side is not None and address.agent is not None
        return None if of_agent and Seat(address.side or "", address.agent or "") not in self._seats else address

    def _note_left_out(self, key: str) -> None:
        foreign = f"{self._foreign[key]} samples that name somebody else" if self._foreign[key] else ""
        words = ", ".join(filter(None, (self._allowance.left_out(key), foreign)))
        self._recorder.note_left_out(key, words)

    async def close(self) -> None:
        """Close the bus below; the owner of the recorder closes it."""
        await self._bus.close()


class Exchanges:
    """Which exchanges the newest reply of each agent announces, and which of them have arrived.

    They travel under another key than the reply, and may arrive after it. Without a look at them the recording of a
    match would end before those of its last step.
    """

    def __init__(self) -> None:
        self._announced: dict[Seat, tuple[_Step, int]] = {}
        self._arrived: dict[Seat, tuple[_Step, int]] = {}
        self._replies = Counter[Seat]()
        self._changed = asyncio.Event()

    def take(self, address: Address, said: dict[str, Any]) -> None:
        """Take what a recorded message says of them."""
        if address.topic not in {Topic.REPLY, Topic.EXCHANGE} or address.side is None or address.agent is None:
            return
        seat = Seat(address.side, address.agent)
        step = (said.get("episode"), said.get("step"))
        if not isinstance(step[0], int) or not isinstance(step[1], int):
            return
        at = (step[0], step[1])
        if address.topic is Topic.REPLY and isinstance(count := said.get("attempts", 0), int):
            self._announced[seat] = (at, count)
            self._replies[seat] += 1
        elif said.get("purpose", "decision") == "decision":
            last, count = self._arrived.get(seat, ((-1, -1), 0))
            self._arrived[seat] = (at, count + 1 if at == last else 1) if at >= last else (last, count)
        self._changed.set()

    def missing(self) -> list[Seat]:
        """Return the agents of which announced ones have not arrived; a policy that never sends any does not count."""
        return [
            seat
            for seat, announced in self._announced.items()
            if announced[1] and self._arrived.get(seat, ((-1, -1), 0)) < announced and self._is_sender(seat)
        ]

    def _is_sender(self, seat: Seat) -> bool:
        return seat in self._arrived or self._replies[seat] == 1

    async def complete(self) -> None:
        """Wait until none is missing."""
        while self.missing():
            self._changed.clear()
            await self._changed.wait()


class Listener:
    """A subscription to topics that the host itself does not need, so that they are recorded. A context manager.

    At the end of a match it waits for exchanges that are missing, for `LAST_EXCHANGES_S` at most.
    """

    def __init__(self, bus: RecordingBus, run: str) -> None:
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
        if error is None and not self._task.done():
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(LAST_EXCHANGES_S):
                    await self._bus.exchanges.complete()
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
        take: Callable[[Sample], bool],
    ) -> None:
        self._subscription = subscription
        self._take = take

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
            if self._take(sample):
                return sample
        raise StopAsyncIteration

    async def close(self) -> None:
        await self._subscription.close()


def _fields(payload: bytes) -> dict[str, Any]:
    """Return the fields of a message; none if the bytes are no message."""
    try:
        said = from_json(payload)
    except ValueError:
        return {}
    return said if isinstance(said, dict) else {}


async def _drain(samples: Subscription[Sample]) -> None:
    async for _ in samples:
        pass
