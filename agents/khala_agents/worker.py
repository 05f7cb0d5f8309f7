"""One agent on the bus: an observation in, one reply out.

The worker owns everything that a policy need not know: the bus, the deadline, and that every step is answered
exactly once. An agent that rethinks answers a verdict on its reply, too, within the time of the observation: with a
better reply, or with the same one again. The worker announces the agent's liveliness and receives briefings and
observations (the newest supersedes the older ones, and cancels a decision that is still being made for one of them). It
has a policy decide under `khala_agents.guard`, and sends the reply with its usage. It does not read the reply: the host
does.

It may join late or be restarted: it gets briefing and newest observation as soon as it subscribes. Below it
are `protocol` and a policy; above it are the command line, and tests.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import Counter
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Literal, TypeVar

from khala_agents.briefings import Briefings
from khala_agents.guard import Guard
from khala_agents.ledger import UsageLedger
from khala_agents.links import Links, join
from khala_agents.pictures import PictureStore
from khala_agents.policy import Context, Decision
from khala_agents.time_to_decide import time_to_decide_s
from khala_protocol.codec import decode_as, encode
from khala_protocol.errors import BusClosed, BusError, PeerError
from khala_protocol.messages import Briefing, Reply, Result, Usage, Wire
from khala_protocol.unread import decode_observation

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Mapping

    from khala_agents.policy import Policy, Said
    from khala_protocol.bus import Bus, Sample, Subscription
    from khala_protocol.messages import Observation

log = logging.getLogger(__name__)

M = TypeVar("M", bound=Wire)
Ending = Literal["result", "stopped", "bus closed"]

UNWIND_S = 1.0
"""Time that cancelled decisions get to end, when the worker ends."""


@dataclass(slots=True)
class WorkerTally:
    """The work of a worker so far.

    Attributes:
        replies: replies sent, by status.
        undecided: those that were not the agent's own, by their cause.
        superseded: observations that were not answered, because a newer one arrived.
        usage: the usage of all requests.
        ended: why the worker ended.
    """

    replies: Counter[str] = field(default_factory=Counter)
    undecided: Counter[str] = field(default_factory=Counter)
    superseded: int = 0
    usage: Usage = field(default_factory=Usage)
    ended: Ending = "stopped"


async def run_worker(
    bus: Bus,
    run: str,
    side: str,
    name: str,
    policy: Policy,
    *,
    stop: asyncio.Event | None = None,
) -> WorkerTally:
    """Play one agent until the run's last result, or until `stop` is set or the bus is closed.

    Args:
        bus: stays open afterwards.
        run: name of the run.
        side: side of the agent.
        name: name of the agent.
        policy: decides; closed afterwards. If it does not answer in time, an empty reply with the status `late` is
            sent.
        stop: ends the worker when it is set.
    """
    return await Worker(bus, run, side, name, policy).play(stop or asyncio.Event())


async def run_workers(
    bus: Bus,
    run: str,
    side: str,
    policies: Mapping[str, Policy],
    *,
    stop: asyncio.Event | None = None,
) -> dict[str, WorkerTally]:
    """Play several agents in one process, each with its own policy, until all have ended."""
    stop = stop or asyncio.Event()
    async with asyncio.TaskGroup() as group:
        tasks = {
            name: group.create_task(run_worker(bus, run, side, name, policy, stop=stop), name=f"agent {name}")
            for name, policy in policies.items()
        }
    return {name: task.result() for name, task in tasks.items()}


class Worker:
    """One agent's part in one run; see the module."""

    def __init__(self, bus: Bus, run: str, side: str, name: str, policy: Policy) -> None:
        self.tally = WorkerTally()
        self._bus = bus
        self._run, self._side, self._name = run, side, name
        self._policy = policy
        self._guard = Guard(name)
        self._clock = asyncio.get_running_loop().time
        self._ended = asyncio.Event()
        self._ledger = UsageLedger(name)
        self._briefings = Briefings()
        self._pictures = PictureStore()
        self._last_result: int | None = None
        self._newest: Observation | None = None
        self._began_again = False
        self._arrived = 0.0
        """When the newest observation came for the first time, without a verdict."""
        self._last_reply: Reply | None = None
        self._deciding: asyncio.Task[None] | None = None
        self._reflecting: set[asyncio.Task[None]] = set()
        self._preparing: asyncio.Task[None] | None = None

    async def play(self, stop: asyncio.Event) -> WorkerTally:
        """Join, answer, and leave; see `run_worker`."""
        async with AsyncExitStack() as stack:
            stack.push_async_callback(self._guard.safely, "closing the policy", self._policy.close)
            try:
                links = await join(stack, self._bus, self._run, self._side, self._name)
                await self._serve(links, stop)
            except* BusClosed:
                self.tally.ended = "bus closed"
        self.tally.usage = self._ledger.usage
        return self.tally

    async def _serve(self, links: Links, stop: asyncio.Event) -> None:
        async with asyncio.TaskGroup() as group:
            tasks = [
                group.create_task(self._hear_images(links), name=f"images {self._name}"),
                group.create_task(self._hear_briefings(links, group), name=f"briefings {self._name}"),
                group.create_task(self._hear_results(links)),
                group.create_task(self._hear_observations(links, group), name=f"observations {self._name}"),
                group.create_task(self._ledger.publish(links.exchanges)),
                group.create_task(self._watch(stop)),
            ]
            await self._ended.wait()
            for task in (*tasks, self._deciding, self._preparing, *self._reflecting):
                _cancel(task)
            if self._deciding:
                await asyncio.wait({self._deciding})
            await self._guard.settle(UNWIND_S)
            await self._ledger.flush(links.exchanges)

    # --- hearing ------------------------------------------------------------------------------------

    async def _hear_briefings(self, links: Links, group: asyncio.TaskGroup) -> None:
        async for briefing in self._read(partial(decode_as, Briefing), links.briefings):
            newest = self._briefings.newest
            if newest is not None and briefing.episode <= newest.episode:  # another host, with steps from 0 perhaps
                self._began_again = True
                self._last_result = None
            if await self._briefings.put(briefing):
                _cancel(self._preparing)
                preparing = self._guard.safely("preparing the policy", self._policy.prepare, briefing)
                self._preparing = group.create_task(preparing, name=f"prepare {self._name}")
            self._end_if_over()

    async def _hear_images(self, links: Links) -> None:
        async for sample in links.images:
            await self._pictures.put(sample.payload)

    async def _hear_results(self, links: Links) -> None:
        async for result in self._read(partial(decode_as, Result), links.results):
            self._last_result = result.episode
            self._end_if_over()

    async def _hear_observations(self, links: Links, group: asyncio.TaskGroup) -> None:
        async for observation in self._read(decode_observation, links.observations):
            at = _place_of(observation)
            if not self._is_new(observation):
                await self._repeat(at, links)
                continue
            if self._reply_before(observation) is None:
                self._arrived = self._clock()
                self._ledger.open(at[:2])
            self._newest = observation
            self._began_again = False
            self._supersede()
            answering = self._answer(observation, links, group)
            self._deciding = group.create_task(answering, name=f"answer {self._name} {at}")
        self._end("bus closed")

    def _is_new(self, observation: Observation) -> bool:
        """Return whether to decide; a host that goes on after it was killed asks for its open step word for word."""
        newest = self._newest
        if newest is None:
            return True
        here, before = (_place_of(observed) for observed in (observation, newest))
        if not self._began_again:
            return here > before
        try:
            return observation != newest
        except PeerError as error:  # views are read late, and a policy that looks at this one fails by itself
            log.warning("agent %s: the view of step %d or %d cannot be read: %s", self._name, here[1], before[1], error)
            return here != before

    async def _read(self, decode: Callable[[bytes], M], samples: Subscription[Sample]) -> AsyncIterator[M]:
        """Yield the messages that can be decoded, without anything else that arrives."""
        async for sample in samples:
            try:
                yield decode(sample.payload)
            except PeerError as error:
                log.warning("agent %s: %s is dropped: %s", self._name, sample.key, error)

    async def _watch(self, stop: asyncio.Event) -> None:
        await stop.wait()
        self._end("stopped")

    # --- answering ----------------------------------------------------------------------------------

    async def _answer(self, observation: Observation, links: Links, group: asyncio.TaskGroup) -> None:
        """Play one turn: decide, send, then have the policy think on. Sending cannot be cancelled."""
        arrived = self._arrived
        refused = self._reply_before(observation)
        time_s = time_to_decide_s(observation.answer_within_s)
        left_s = None if time_s is None else max(arrived + time_s - self._clock(), 0.0)
        deciding = self._decide(observation, arrived, refused.text if refused else "")
        decision = await self._guard.within(left_s, deciding)
        if refused is not None and decision.status not in ("ok", "fallback"):
            decision = _same_again(refused)
        self._deciding = None
        try:
            await self._send(observation, decision, links, latency_s=self._clock() - arrived)
        except BusClosed:
            self._end("bus closed")
        except BusError as error:  # the host will find this step unanswered, and the next may get through
            log.warning("agent %s: the reply to step %d could not be sent: %s", self._name, observation.step, error)
        else:
            self._reflect(observation, group)

    def _reflect(self, observation: Observation, group: asyncio.TaskGroup) -> None:
        briefing = self._briefings.newest
        if briefing is None or self._ended.is_set():
            return
        context = Context(briefing, observation, self._pictures, self._ledger.note, self._clock())
        task = group.create_task(self._guard.safely("reflecting", self._policy.reflect, context))
        self._reflecting.add(task)
        task.add_done_callback(self._reflecting.discard)

    async def _decide(self, observation: Observation, arrived: float, refused: str) -> Said:
        briefing = await self._briefings.of(observation.episode)
        context = Context(briefing, observation, self._pictures, self._ledger.note, arrived, refused=refused)
        return await self._policy.decide(context)

    def _reply_before(self, observation: Observation) -> Reply | None:
        """Return the reply that an observation's verdict is on; None without a verdict, or if another process gave it.

        An agent that was started again in between has its whole time again, as after any other observation.
        """
        last = self._last_reply
        if observation.verdict is None or last is None:
            return None
        episode, step, number = _place_of(observation)
        return last if (last.episode, last.step, last.rethinks) == (episode, step, number - 1) else None

    async def _send(self, observation: Observation, decision: Decision, links: Links, *, latency_s: float) -> None:
        attempts, usage = self._ledger.account()  # before any await, because another step may begin meanwhile
        reply = Reply(
            run=self._run,
            side=self._side,
            agent=self._name,
            episode=observation.episode,
            step=observation.step,
            text=decision.text,
            status=decision.status,
            detail=decision.detail,
            reason=decision.reason,
            hopeless=decision.hopeless,
            cut=decision.cut,
            rethink=self._policy.rethink,
            rethinks=_place_of(observation)[2],
            latency_s=latency_s,
            attempts=attempts or decision.attempts,
            usage=usage if attempts or usage.requests else decision.usage,
            pace=self._policy.pace,
            human=self._policy.human,
        )
        self._last_reply = reply
        await links.replies.put(encode(reply))
        self._count(reply)

    async def _repeat(self, at: tuple[int, int, int], links: Links) -> None:
        """Send the reply to an observation again that the host sent again: a link was down, and it may be lost."""
        last = self._last_reply
        if last is not None and (last.episode, last.step, last.rethinks) == at:
            with contextlib.suppress(BusError):
                await links.replies.put(encode(last))

    def _supersede(self) -> None:
        if self._deciding is not None:
            self._deciding.cancel()
            self._deciding = None
            self.tally.superseded += 1

    def _count(self, reply: Reply) -> None:
        self.tally.replies[reply.status] += 1
        if reply.status != "ok":
            self.tally.undecided[reply.detail or reply.status] += 1

    # --- ending -------------------------------------------------------------------------------------

    def _end_if_over(self) -> None:
        briefing = self._briefings.newest
        if briefing is not None and self._last_result is not None and self._last_result >= briefing.episodes - 1:
            self._end("result")

    def _end(self, why: Ending) -> None:
        if not self._ended.is_set():
            self.tally.ended = why
            self._ended.set()


def _place_of(observation: Observation) -> tuple[int, int, int]:
    """Return episode, step, and the number of the verdict, 0 for none."""
    return observation.episode, observation.step, observation.verdict.number if observation.verdict else 0


def _same_again(reply: Reply) -> Decision:
    """Return the decision of a reply, which stands because no better one came."""
    return Decision(reply.text, reply.status, reply.detail, reason=reply.reason, hopeless=reply.hopeless, cut=reply.cut)


def _cancel(task: asyncio.Task[None] | None) -> None:
    if task is not None:
        task.cancel()
