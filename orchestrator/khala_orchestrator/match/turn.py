"""Ask agents, and take their answers: all of them by a deadline, or those that have arrived.

Below it: publishers of observations and their pictures, and one inbox of replies. Above it:
`khala_orchestrator.match.match`, which decides who is asked when. It knows nothing of games;
`khala_orchestrator.match.replies` reads the text of an answer. A question is open until its answer is collected. The
first valid reply to an open question counts; all others are counted as ignored and dropped.

An agent may ask to rethink (`Reply.rethink`): a reply of which nothing is possible is answered with a verdict, and its
next reply counts, within the same deadline. If none comes, the reply before stands.

The wait for an agent ends early when what it sent is not a reply, or when its liveliness token goes: it may still
answer while the question is open. A required agent that goes is waited for as long as the clock's grace, and once it
is back, as long as anybody: a restarted agent finds the question on the bus. If it does not come, it is lost.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self

from khala_orchestrator.match.validity import AWAY
from khala_orchestrator.roster import Seat
from khala_protocol.bus import Delivery
from khala_protocol.codec import decode_as, encode
from khala_protocol.errors import BusClosed, PeerError, WrongKey
from khala_protocol.keys import Topic, agent_key, every_agent, image_key, parse
from khala_protocol.messages import AgentStatus, Observation, Reply, Usage, Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from types import TracebackType

    from khala_orchestrator.roster import Roster
    from khala_protocol.bus import Bus, Publisher, Sample, Subscription
    from khala_protocol.messages import Advice

log = logging.getLogger(__name__)

ASK_AGAIN_S = 1.0
"""How often an agent that is away is asked again."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The outcome of asking one agent.

    Attributes:
        status: who decided, or why nobody did; `late` and `gone` have no reply.
        latency_s: from the publication of the observation to the reply's arrival.
        ignored: replies of this agent that arrived since its answer before and were not accepted.
        verdicts: the host's words on its replies to the same question before this one.
    """

    status: AgentStatus
    reply: Reply | None = None
    detail: str = ""
    latency_s: float | None = None
    ignored: int = 0
    verdicts: tuple[str, ...] = ()

    @property
    def text(self) -> str | None:
        """The words of the reply."""
        return self.reply.text if self.reply else None

    @property
    def reason(self) -> str:
        """Why the agent did not decide, in the words of its endpoint or its policy."""
        return self.reply.reason if self.reply else ""

    @property
    def cut(self) -> bool:
        """Whether its model reached its limit of tokens within the text."""
        return self.reply is not None and self.reply.cut

    @property
    def human(self) -> bool:
        """Whether a person decided."""
        return self.reply is not None and self.reply.human

    @property
    def usage(self) -> Usage:
        """The usage of the reply."""
        return self.reply.usage if self.reply else Usage()


@dataclass(frozen=True, slots=True)
class Answers:
    """The outcome of asking: an answer for each seat whose question is settled, in the order of the questions."""

    by_seat: Mapping[Seat, Answer]
    publish_s: float = 0.0
    wait_s: float = 0.0
    held_s: float = 0.0
    """Of `wait_s`: until the last agent that was away was back, and had all its time again."""
    lost: Mapping[Seat, str] = field(default_factory=dict)
    """Required agents that will not decide any more, and why: they went away and did not come back within the grace, or
    their endpoint refuses them for good."""
    incidents: Sequence[str] = ()
    """What failed while the agents were asked, and was overcome or not; a sentence each."""
    advice: Sequence[Advice] = ()
    """What advisers have written since they were last asked."""


class Question(NamedTuple):
    """The question to one agent: its observation, and the pictures that the observation names, in their order."""

    observation: Observation
    pictures: Sequence[bytes] = ()


class Judge(Protocol):
    """Judges a reply when it arrives."""

    def __call__(self, seat: Seat, answer: Answer) -> str:
        """Return the verdict on a reply of which nothing is possible; "" if something is, or nothing was tried."""
        ...


class AgentPool(Protocol):
    """The agents of a match, as the match sees them; a recording can stand in for live ones."""

    async def ask(self, questions: Iterable[Question], *, wait: bool = True) -> Answers:
        """Publish observations, and return the answers to all questions, or those that there are without waiting.

        Called once in each step, with no question if nobody is to be asked.
        """
        ...


@dataclass(slots=True)
class _Question:
    """An open question: what was asked, until when it is waited for, and what came."""

    observation: Observation
    payload: bytes
    asked_at: float
    until: float | None = None
    waiting: bool = True
    held_at: float | None = None
    """When its agent, which is required, went away."""
    reply: Reply | None = None
    """The newest one that counts."""
    arrived_at: float = 0.0
    fault: str = ""
    verdicts: list[str] = field(default_factory=list)
    """On the replies so far."""

    @property
    def held(self) -> bool:
        """Whether its agent is required and away."""
        return self.held_at is not None

    def wait_until_answered(self, now: float) -> None:
        """Give the agent its time, unless it is away."""
        if not self.held and self.observation.answer_within_s is not None:
            self.until = now + self.observation.answer_within_s

    @property
    def is_answered(self) -> bool:
        """Whether a reply came to what was asked last: the observation, or the verdict on the reply before."""
        return self.reply is not None and self.reply.rethinks == len(self.verdicts)

    def answers_to(self, reply: Reply) -> bool:
        """Return whether a reply is the first one to what was asked last."""
        asked = (self.observation.episode, self.observation.step, len(self.verdicts))
        return not self.is_answered and (reply.episode, reply.step, reply.rethinks) == asked

    def ask_again(self, verdict: str) -> None:
        """Ask the same again, with a verdict on the newest reply."""
        self.verdicts.append(verdict)
        number = len(self.verdicts)
        self.observation = self.observation.model_copy(update={"verdict": Verdict(number=number, text=verdict)})
        self.payload = encode(self.observation)


class Turn:
    """An `AgentPool` over a bus. An asynchronous context manager."""

    def __init__(
        self,
        bus: Bus,
        run: str,
        roster: Roster,
        *,
        required: Iterable[Seat] = (),
        grace_s: float = 0.0,
        advice: Callable[[], Sequence[Advice]] = lambda: (),
        judge: Judge = lambda seat, answer: "",  # noqa: ARG005  # the names that a judge's arguments have
    ) -> None:
        """Take a bus, the run's name, its agents, and the required ones, which are waited for when they are away.

        `advice` returns what advisers have written since it was last called; `judge` says whose reply is answered with
        a verdict.
        """
        self._bus = bus
        self._run = run
        self._roster = roster
        self._required = frozenset(required)
        self._grace_s = grace_s
        self._advice = advice
        self._judge = judge
        self._publishers: dict[Seat, Publisher] = {}
        self._frames: dict[tuple[Seat, int], Publisher] = {}
        self._inbox: Subscription[Sample] | None = None
        self._pump: asyncio.Task[None] | None = None
        self._ignored: Counter[Seat] = Counter()
        self._open: dict[Seat, _Question] = {}
        self._incidents: list[str] = []
        self._held_until = 0.0
        """When an agent was last away that the clock stood still for."""
        self._changed = asyncio.Event()

    async def __aenter__(self) -> Self:
        for seat in self._roster.seats:
            key = agent_key(self._run, seat.side, seat.agent, Topic.OBSERVATION)
            self._publishers[seat] = await self._bus.publisher(key, Delivery.STATE)
        self._inbox = await self._bus.subscribe(every_agent(self._run, Topic.REPLY), Delivery.SPEECH)
        self._pump = asyncio.create_task(self._take_replies(self._inbox), name="inbox of replies")
        self._pump.add_done_callback(lambda _: self._changed.set())
        self._roster.on_change(gone=self._gone, here=self._here)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._inbox is not None and self._pump is not None
        self._open.clear()  # agents leave now, and nobody waits for them
        await self._inbox.close()
        await asyncio.wait([self._pump])
        for publisher in (*self._publishers.values(), *self._frames.values()):
            await publisher.close()
        if error is None:
            self._pump.result()

    async def ask(self, questions: Iterable[Question], *, wait: bool = True) -> Answers:
        """Publish the observations, each after its pictures; then collect answers.

        Args:
            questions: one per seat at most. They may be made lazily: each is published before the next is taken. A
                question to a seat whose question is still open takes its place.
            wait: wait until every open question is settled: answered, or past its deadline.
        """
        now = asyncio.get_running_loop().time
        publish_s = 0.0
        asked = list[_Question]()
        for question in questions:
            began = now()
            asked.append(await self._publish(question, began))
            publish_s += now() - began
        began = now()
        for open_question in asked:
            open_question.wait_until_answered(began)
        if wait:
            await self._wait()
        wait_s = now() - began
        answers = self._collect()
        held_s = min(max(self._held_until - began, 0.0), wait_s)
        return replace(answers, publish_s=publish_s, wait_s=wait_s, held_s=held_s)

    # --- asking -------------------------------------------------------------------------------------

    async def _publish(self, question: Question, now: float) -> _Question:
        observation = question.observation
        seat = Seat(observation.side, observation.agent)
        await self._show(seat, question.pictures)
        self._open[seat] = asked = _Question(observation, encode(observation), now)
        await self._publishers[seat].put(asked.payload)
        if not self._roster.is_reachable(seat):
            self._gone(seat)
        return asked

    async def _show(self, seat: Seat, pictures: Sequence[bytes]) -> None:
        """Publish pictures, each under the key of its place, so that late joiners find all of the newest ones."""
        for place, picture in enumerate(pictures):
            if (seat, place) not in self._frames:
                key = image_key(self._run, seat.side, seat.agent, place)
                self._frames[seat, place] = await self._bus.publisher(key, Delivery.STATE)
            await self._frames[seat, place].put(picture)

    def _gone(self, seat: Seat) -> None:
        """Wait for a required agent until its grace is over, and no longer for another one that is not there."""
        asked = self._open.get(seat)
        if asked is None or not asked.waiting or asked.held:
            return
        if asked.reply is not None:  # which stands
            asked.waiting = False
        elif seat in self._required:
            asked.held_at = asyncio.get_running_loop().time()
            asked.until = asked.held_at + self._grace_s
            log.warning("required agent %s is away; waiting for it for %g s", seat, self._grace_s)
        elif not self._roster.is_present(seat):
            asked.waiting = False
        self._changed.set()

    async def _here(self, seat: Seat) -> None:
        """Ask an agent again that is back: what it sent while its link was down is lost, and it may send it again."""
        asked = self._open.get(seat)
        if asked is None or asked.is_answered:
            return
        if asked.held_at is not None:
            now = asyncio.get_running_loop().time()
            self._note(f"required agent {seat} was away for {now - asked.held_at:.1f} s")
            self._end_hold(asked, now)
            asked.until = None
            asked.wait_until_answered(now)
            self._changed.set()
        await self._publishers[seat].put(asked.payload)

    def _end_hold(self, asked: _Question, now: float) -> None:
        asked.held_at = None
        self._held_until = now

    # --- collecting ---------------------------------------------------------------------------------

    async def _wait(self) -> None:
        """Wait until no open question is waited for."""
        while waiting := [asked for asked in self._open.values() if asked.waiting]:
            self._check_pump()
            moments = [asked.until for asked in waiting if asked.until is not None]
            if any(asked.held for asked in waiting):
                moments.append(asyncio.get_running_loop().time() + ASK_AGAIN_S)
            self._changed.clear()
            try:
                async with asyncio.timeout_at(min(moments, default=None)):
                    await self._changed.wait()
            except TimeoutError:
                self._close_overdue()
                await self._ask_again()

    async def _ask_again(self) -> None:
        """Ask those that seem to be away: news of a token may be lost, and an agent that answers is there."""
        for seat, asked in self._open.items():
            if asked.held and asked.waiting:
                await self._publishers[seat].put(asked.payload)

    def _close_overdue(self) -> None:
        now = asyncio.get_running_loop().time()
        for seat, asked in self._open.items():
            if asked.waiting and asked.until is not None and asked.until <= now:
                asked.waiting = False
                log.info("step %d: no reply in time from %s", asked.observation.step, seat)

    def _collect(self) -> Answers:
        """Return the answers to the settled questions, which are closed."""
        self._check_pump()
        self._close_overdue()
        settled = {seat: asked for seat, asked in self._open.items() if not asked.waiting}
        for seat in settled:
            del self._open[seat]
        answers = {seat: self._answer(seat, asked) for seat, asked in settled.items()}
        lost = {seat: why for seat, asked in settled.items() if (why := self._why_lost(seat, asked))}
        for seat in (seat for seat, why in lost.items() if why == AWAY):
            self._note(f"required agent {seat} did not come back within {self._grace_s:g} s")
            self._held_until = asyncio.get_running_loop().time()
        incidents, self._incidents = self._incidents, []
        return Answers(answers, lost=lost, incidents=incidents, advice=self._advice())

    def _why_lost(self, seat: Seat, asked: _Question) -> str:
        """Return why an agent will not decide any more that the match needs; "" if it may."""
        if asked.held:
            return AWAY
        if asked.reply is not None and asked.reply.hopeless and seat in self._required:
            return asked.reply.reason or asked.reply.detail
        return ""

    def _note(self, incident: str) -> None:
        log.warning("%s", incident)
        self._incidents.append(incident)

    def _answer(self, seat: Seat, asked: _Question) -> Answer:
        ignored = self._ignored.pop(seat, 0)
        if asked.reply is not None:
            latency_s = asked.arrived_at - asked.asked_at
            verdicts = tuple(asked.verdicts[: asked.reply.rethinks])
            return Answer(asked.reply.status, asked.reply, asked.reply.detail, latency_s, ignored, verdicts)
        if asked.fault:
            return Answer("malformed", detail=asked.fault, ignored=ignored)
        if not self._roster.is_present(seat):
            return Answer("gone", detail="its liveliness token went away", ignored=ignored)
        return Answer("late", detail="no reply before the deadline", ignored=ignored)

    def _check_pump(self) -> None:
        """Raise if replies can no longer arrive: every agent would be late from now on."""
        assert self._pump is not None
        if self._pump.done():
            self._pump.result()
            raise BusClosed("the inbox of replies was closed while a match was played")

    # --- the inbox ----------------------------------------------------------------------------------

    async def _take_replies(self, inbox: Subscription[Sample]) -> None:
        async for sample in inbox:
            try:
                address = parse(sample.key)
            except WrongKey as error:
                log.warning("%s", error)
                continue
            assert address.side is not None and address.agent is not None
            await self._take_reply(Seat(address.side, address.agent), sample.payload)

    async def _take_reply(self, seat: Seat, payload: bytes) -> None:
        if seat not in self._publishers:
            log.warning("%s is not in this match, and sent a reply", seat)
            return
        asked = self._open.get(seat)
        try:
            reply = decode_as(Reply, payload)
            self._check_sender(seat, reply)
        except PeerError as error:
            log.warning("agent %s sent no valid reply: %s", seat, error)
            self._ignored[seat] += 1
            if asked is not None and not asked.is_answered and not asked.held:  # one that is away did not send it
                asked.fault = str(error)
                asked.waiting = False
                self._changed.set()
            return
        if asked is None or not asked.answers_to(reply):
            self._ignored[seat] += 1
            return
        asked.reply = reply
        asked.arrived_at = asyncio.get_running_loop().time()
        if asked.held:
            self._end_hold(asked, asked.arrived_at)
        if verdict := self._verdict_on(seat, asked, reply):
            asked.ask_again(verdict)
            await self._publishers[seat].put(asked.payload)
            return
        asked.waiting = False
        if not any(other.waiting for other in self._open.values()):
            self._changed.set()

    def _verdict_on(self, seat: Seat, asked: _Question, reply: Reply) -> str:
        """Return what is said to an agent that rethinks of a reply of which nothing is possible; "" to go on."""
        if not asked.waiting or reply.rethinks >= reply.rethink:
            return ""
        return self._judge(seat, Answer(reply.status, reply, verdicts=tuple(asked.verdicts)))

    def _check_sender(self, seat: Seat, reply: Reply) -> None:
        if (reply.run, reply.side, reply.agent) != (self._run, *seat):
            raise WrongKey(f"reply of {reply.side}/{reply.agent} in run {reply.run} stands under the key of {seat}")
