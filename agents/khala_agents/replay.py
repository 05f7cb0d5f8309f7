"""Show recorded observations to an agent again, and compare its replies with the recorded ones.

Worker and prompt are the real ones, on a bus in memory. The recorded completions replace the model, or the caller's
policy replaces the whole policy. Observations that were not answered in time in the recording are left out: the
behaviour of an agent that is cut off depends on the clock.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, NamedTuple

from khala_agents.build import replay_policies
from khala_agents.worker import run_worker
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import decode_as, encode
from khala_protocol.errors import RecordingError
from khala_protocol.keys import Topic, agent_key, image_key
from khala_protocol.messages import Briefing, ModelCall, Observation, Reply
from khala_protocol.recording.difference import Difference

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Iterator

    from khala_agents.policy import Policy
    from khala_protocol.bus import Bus, Publisher, Sample, Subscription
    from khala_protocol.messages import AgentCard
    from khala_protocol.recording import Recording

PATIENCE_S = 30.0
"""How long a reply that waits for no model may take."""


async def replay_agent(recording: Recording, agent: str, policy: Policy | None = None) -> list[Difference]:
    """Replay one agent of a recording.

    Args:
        recording: of a run.
        agent: its name, or that of its side before it (`red/Captain`), if both sides have an agent of this name.
        policy: decides; by default the language model policy with the recorded completions.

    Returns:
        every reply that differs from the recorded one.

    Raises:
        RecordingError: the recording has no such agent, or none of its requests and no policy is given.
    """
    run = recording.run
    cards = run.agents if run else ()
    card = next((card for card in cards if agent in {card.name, f"{card.side}/{card.name}"}), None)
    if run is None or card is None:
        raise RecordingError(f"{recording.path} has no agent {agent}")
    if policy is None:
        policies = replay_policies(recording.of(ModelCall, agent=card.name, side=card.side))
        if card.name not in policies:
            raise RecordingError(
                f"{recording.path} has no requests of {agent} to a model: give the policy it played with"
            )
        policy = policies[card.name]
        replies = recording.of(Reply, agent=card.name, side=card.side)
        policy.rethink = next((reply.rethink for reply in replies), 0)
    broker = MemoryBroker()
    bus = broker.session()
    stage = await _Stage.set(bus, run.run, card.side, card.name)
    stop = asyncio.Event()
    worker = asyncio.create_task(run_worker(broker.session(), run.run, card.side, card.name, policy, stop=stop))
    try:
        return [difference async for difference in stage.play(_script(recording, card))]
    finally:
        stop.set()
        await worker
        await bus.close()


class _Scene:
    """One observation and the reply to it."""

    def __init__(self, observation: Observation, reply: Reply) -> None:
        self.observation, self.reply = observation, reply


class _Image(NamedTuple):
    """A picture, and the key that it was published under."""

    place: int
    data: bytes


_Part = Briefing | _Image | _Scene


def _script(recording: Recording, card: AgentCard) -> Iterator[_Part]:
    """Return briefings, pictures, and the observations that were answered, in their order."""
    whose = {"agent": card.name, "side": card.side}
    replies = {(r.episode, r.step, r.rethinks): r for r in reversed(list(recording.of(Reply, **whose)))}
    for sample in recording:
        address = sample.address
        if address is None or (address.side, address.agent) != (card.side, card.name):
            continue
        if address.topic is Topic.IMAGE:
            yield _Image(int(address.instance or 0), sample.payload)
            continue
        match sample.message:
            case Briefing() as briefing:
                yield briefing
            case Observation() as seen if reply := replies.get(_place_of(seen)):
                yield _Scene(seen, reply)


class _Stage:
    """The host's side of the bus, for one agent."""

    def __init__(
        self,
        briefings: Publisher,
        observations: Publisher,
        replies: Subscription[Sample],
        frame: Callable[[int], Awaitable[Publisher]],
    ) -> None:
        self._frame = frame
        self._frames: dict[int, Publisher] = {}
        self._briefings, self._observations = briefings, observations
        self._replies = replies

    @classmethod
    async def set(cls, bus: Bus, run: str, side: str, agent: str) -> _Stage:
        def key(topic: Topic) -> str:
            return agent_key(run, side, agent, topic)

        def frame(place: int) -> Awaitable[Publisher]:
            return bus.publisher(image_key(run, side, agent, place), Delivery.STATE)

        return cls(
            await bus.publisher(key(Topic.BRIEFING), Delivery.STATE),
            await bus.publisher(key(Topic.OBSERVATION), Delivery.STATE),
            await bus.subscribe(key(Topic.REPLY), Delivery.SPEECH),
            frame,
        )

    async def _show(self, image: _Image) -> None:
        if image.place not in self._frames:
            self._frames[image.place] = await self._frame(image.place)
        await self._frames[image.place].put(image.data)

    async def play(self, script: Iterator[_Part]) -> AsyncIterator[Difference]:
        for part in script:
            if isinstance(part, _Image):
                await self._show(part)
                continue
            if isinstance(part, Briefing):
                await self._briefings.put(encode(part))
                continue
            await self._observations.put(encode(part.observation))
            async with asyncio.timeout(PATIENCE_S):
                reply = decode_as(Reply, (await anext(self._replies)).payload)
            recorded, sent = _content(part.reply), _content(reply)
            if recorded != sent:
                yield Difference(reply.agent, reply.episode, reply.step, "reply", recorded, sent)


def _place_of(seen: Observation) -> tuple[int, int, int]:
    """Return episode, step, and the number of the verdict, 0 for none."""
    return seen.episode, seen.step, seen.verdict.number if seen.verdict else 0


def _content(reply: Reply) -> str:
    """Return the words of a reply, without its times."""
    return reply.model_dump_json(exclude={"latency_s", "usage"})
