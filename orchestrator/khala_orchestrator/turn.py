"""Ask every agent at once, and wait until all have replied or the deadline has passed.

Below it: publishers of observations and their pictures, and one inbox of replies. Above it: `khala_orchestrator.match`,
which reads the text of a reply. It knows nothing of games. A reply is accepted if it is the first valid one of its
agent for the open step; all others are counted as ignored and dropped. The wait for an agent ends early when its
liveliness token goes, or when what it sent is not a reply: it may still answer while the step is open.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self

from khala_orchestrator.roster import Seat
from khala_protocol.bus import Delivery
from khala_protocol.codec import decode_as, encode
from khala_protocol.errors import PeerError, WrongKey
from khala_protocol.keys import Topic, agent_key, every_agent, image_key, parse
from khala_protocol.messages import AgentStatus, Observation, Reply, Usage

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from types import TracebackType

    from khala_orchestrator.roster import Roster
    from khala_protocol.bus import Bus, Publisher, Sample, Subscription

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Answer:
    """The outcome of asking one agent.

    Attributes:
        status: `ok` and `fallback` have a reply, the others none.
        latency_s: from the publication of the observation to the reply's arrival.
        ignored: replies of this agent that arrived during the step and were not accepted.
    """

    status: AgentStatus
    reply: Reply | None = None
    detail: str = ""
    latency_s: float | None = None
    ignored: int = 0

    @property
    def text(self) -> str | None:
        """The words of the reply."""
        return self.reply.text if self.reply else None

    @property
    def usage(self) -> Usage:
        """The usage of the reply."""
        return self.reply.usage if self.reply else Usage()


@dataclass(frozen=True, slots=True)
class Answers:
    """The outcome of asking in one step: an answer for each seat that was asked, in the order of the questions."""

    by_seat: Mapping[Seat, Answer]
    publish_s: float = 0.0
    wait_s: float = 0.0


class Question(NamedTuple):
    """The question to one agent: its observation, and the pictures that the observation names, in their order."""

    observation: Observation
    pictures: Sequence[bytes] = ()


class AgentPool(Protocol):
    """The agents of a match, as the match sees them; a recording can stand in for live ones."""

    async def ask(self, questions: Iterable[Question]) -> Answers:
        """Publish one observation to each agent and return their answers."""
        ...


@dataclass
class _Step:
    """The open step: the agents asked, those still awaited, and their replies."""

    episode: int = -1
    number: int = -1
    complete: bool = False
    asked_at: dict[Seat, float] = field(default_factory=dict)
    waiting: set[Seat] = field(default_factory=set)
    taken: dict[Seat, tuple[Reply, float]] = field(default_factory=dict)
    faults: dict[Seat, str] = field(default_factory=dict)
    settled: asyncio.Event = field(default_factory=asyncio.Event)

    def open(self, seat: Seat, observation: Observation, now: float) -> Self:
        """Begin to wait for one agent."""
        self.episode, self.number = observation.episode, observation.step
        self.asked_at[seat] = now
        self.waiting.add(seat)
        return self

    def all_asked(self) -> None:
        """Settle the step as soon as no agent is awaited."""
        self.complete = True
        self._settle()

    def stop_waiting(self, seat: Seat) -> None:
        """Stop waiting for one agent; it may still answer."""
        self.waiting.discard(seat)
        self._settle()

    def _settle(self) -> None:
        if self.complete and not self.waiting:
            self.settled.set()


class Turn:
    """An `AgentPool` over a bus. An asynchronous context manager."""

    def __init__(self, bus: Bus, run: str, roster: Roster) -> None:
        self._bus = bus
        self._run = run
        self._roster = roster
        self._publishers: dict[Seat, Publisher] = {}
        self._frames: dict[tuple[Seat, int], Publisher] = {}
        self._inbox: Subscription[Sample] | None = None
        self._pump: asyncio.Task[None] | None = None
        self._ignored: Counter[Seat] = Counter()
        self._step: _Step | None = None

    async def __aenter__(self) -> Self:
        for seat in self._roster.seats:
            key = agent_key(self._run, seat.side, seat.agent, Topic.OBSERVATION)
            self._publishers[seat] = await self._bus.publisher(key, Delivery.STATE)
        self._inbox = await self._bus.subscribe(every_agent(self._run, Topic.REPLY), Delivery.SPEECH)
        self._pump = asyncio.create_task(self._take_replies(self._inbox), name="inbox of replies")
        self._roster.on_gone(self._gone)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._inbox is not None and self._pump is not None
        await self._inbox.close()
        await self._pump
        for publisher in (*self._publishers.values(), *self._frames.values()):
            await publisher.close()

    async def ask(self, questions: Iterable[Question]) -> Answers:
        """Publish the observations, each after its pictures, and wait for replies until their deadline.

        Args:
            questions: one per seat, all of the same episode and step and with the same `answer_within_s`. They may be
                made lazily: each is published before the next is taken.
        """
        loop = asyncio.get_running_loop()
        step, within_s, publish_s = _Step(), None, 0.0
        for observation, pictures in questions:
            began = loop.time()
            seat, within_s = Seat(observation.side, observation.agent), observation.answer_within_s
            await self._show(seat, pictures)
            self._step = step.open(seat, observation, began)
            await self._publishers[seat].put(encode(observation))
            if not self._roster.present(seat):
                step.stop_waiting(seat)
            publish_s += loop.time() - began
        began = loop.time()
        step.all_asked()
        try:
            async with asyncio.timeout(within_s):
                await step.settled.wait()
        except TimeoutError:
            log.info("step %d: no reply in time from %s", step.number, ", ".join(map(str, sorted(step.waiting))))
        return self._close(step, publish_s=publish_s, wait_s=loop.time() - began)

    async def _show(self, seat: Seat, pictures: Sequence[bytes]) -> None:
        """Publish pictures, each under the key of its place, so that late joiners find all of the newest ones."""
        for place, picture in enumerate(pictures):
            if (seat, place) not in self._frames:
                key = image_key(self._run, seat.side, seat.agent, place)
                self._frames[seat, place] = await self._bus.publisher(key, Delivery.STATE)
            await self._frames[seat, place].put(picture)

    def _close(self, step: _Step, *, publish_s: float, wait_s: float) -> Answers:
        self._step = None
        answers = {seat: self._answer(step, seat) for seat in step.asked_at}
        self._ignored.clear()
        return Answers(answers, publish_s, wait_s)

    def _answer(self, step: _Step, seat: Seat) -> Answer:
        ignored = self._ignored[seat]
        if seat in step.taken:
            reply, arrived = step.taken[seat]
            return Answer(reply.status, reply, reply.detail, arrived - step.asked_at[seat], ignored)
        if seat in step.faults:
            return Answer("malformed", detail=step.faults[seat], ignored=ignored)
        if not self._roster.present(seat):
            return Answer("gone", detail="its liveliness token went away", ignored=ignored)
        return Answer("late", detail="no reply before the deadline", ignored=ignored)

    def _gone(self, seat: Seat) -> None:
        if self._step is not None:
            self._step.stop_waiting(seat)

    async def _take_replies(self, inbox: Subscription[Sample]) -> None:
        async for sample in inbox:
            try:
                address = parse(sample.key)
            except WrongKey as error:
                log.warning("%s", error)
                continue
            assert address.side is not None and address.agent is not None
            self._take_reply(Seat(address.side, address.agent), sample.payload)

    def _take_reply(self, seat: Seat, payload: bytes) -> None:
        step = self._step
        try:
            reply = decode_as(Reply, payload)
            self._check_sender(seat, reply)
        except PeerError as error:
            log.warning("agent %s sent no valid reply: %s", seat, error)
            self._ignored[seat] += 1
            if step is not None and seat not in step.taken:
                step.faults[seat] = str(error)
                step.stop_waiting(seat)
            return
        fits = step is not None and (reply.episode, reply.step) == (step.episode, step.number)
        if step is None or not fits or seat in step.taken:
            self._ignored[seat] += 1
            return
        step.taken[seat] = (reply, asyncio.get_running_loop().time())
        step.stop_waiting(seat)

    def _check_sender(self, seat: Seat, reply: Reply) -> None:
        if (reply.run, reply.side, reply.agent) != (self._run, *seat):
            raise WrongKey(f"reply of {reply.side}/{reply.agent} in run {reply.run} stands under the key of {seat}")
        if seat not in self._publishers:
            raise WrongKey(f"{seat} is not in this match")
