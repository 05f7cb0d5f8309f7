"""A host to talk to, and a model that answers from a list."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import pytest

from khala_agents.llm.client import Completion, LLMError, Request
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker, MemoryBus
from khala_protocol.codec import decode, encode
from khala_protocol.keys import RUN_TOPICS, Topic, agent_key, every_agent, run_key
from khala_protocol.messages import (
    ActionSpec,
    Briefing,
    Casualties,
    Clock,
    Observation,
    Reply,
    Result,
    TeamSpec,
    Usage,
    View,
    Wire,
)

W = TypeVar("W", bound=Wire)

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Mapping

    from khala_protocol.bus import Publisher, Sample, Subscription

RUN, SIDE, AGENT = "test", "blue", "Stalkers"


# --- messages -----------------------------------------------------------------------------------------


@pytest.fixture
def briefing() -> Callable[..., Briefing]:
    def make(**changes: Any) -> Briefing:
        fields: dict[str, Any] = {
            "run": RUN,
            "agent": AGENT,
            "side": SIDE,
            "episode": 0,
            "role": "You command the Stalkers.",
            "task": "Defeat all enemy units.",
            "teams": (TeamSpec(name="Stalker-1", unit_types=("Stalker",)),),
            "actions": (
                ActionSpec(name="Attack_Unit", args=("tag",), description="attacks an enemy"),
                ActionSpec(name="Move_Screen", args=("screen",)),
            ),
            "clock": Clock(max_wait_s=10.0),
        }
        return Briefing.model_validate(fields | changes)

    return make


@pytest.fixture
def observation() -> Callable[..., Observation]:
    def make(step: int = 0, within_s: float | None = 10.0, **changes: Any) -> Observation:
        fields: dict[str, Any] = {
            "run": RUN,
            "agent": AGENT,
            "side": SIDE,
            "episode": 0,
            "step": step,
            "game_loop": 8 * step,
            "answer_within_s": within_s,
            "text": f"step {step}",
            "view": View(time_s=0.0),
        }
        return Observation.model_validate(fields | changes)

    return make


# --- the other side of the bus ------------------------------------------------------------------------


@dataclass
class Host:
    """The host's part of a run, by hand."""

    bus: MemoryBus
    heard: list[Wire] = field(default_factory=list)
    _publishers: dict[str, Publisher] = field(default_factory=dict)
    _subscriptions: list[Subscription[Sample]] = field(default_factory=list)
    _tasks: list[asyncio.Task[None]] = field(default_factory=list)
    _arrived: asyncio.Event = field(default_factory=asyncio.Event)

    async def listen(self) -> None:
        """Hear replies and messages in one order, and exchanges."""
        speech = (Topic.REPLY, Topic.MESSAGE)
        for topic in (*speech, Topic.EXCHANGE):
            delivery = Delivery.SPEECH if topic in speech else Delivery.LOG
            subscription = await self.bus.subscribe(every_agent(RUN, topic), delivery)
            self._subscriptions.append(subscription)
            self._tasks.append(asyncio.create_task(self._hear(subscription)))

    async def say(self, message: Wire, agent: str = AGENT) -> None:
        """Publish under the key that belongs to the kind of message."""
        topic = Topic(str(message.model_dump()["kind"]))
        await self._put(run_key(RUN, topic) if topic in RUN_TOPICS else agent_key(RUN, SIDE, agent, topic), message)

    async def raw(self, payload: bytes, topic: Topic = Topic.OBSERVATION) -> None:
        """Publish bytes that need not be a message."""
        await self._put(agent_key(RUN, SIDE, AGENT, topic), payload)

    async def _put(self, key: str, what: Wire | bytes) -> None:
        if key not in self._publishers:
            self._publishers[key] = await self.bus.publisher(key, Delivery.STATE)
        await self._publishers[key].put(encode(what) if isinstance(what, Wire) else what)

    async def replies(self, count: int) -> list[Reply]:
        """Wait until this many replies have been heard."""
        while len(found := self.of(Reply)) < count:
            self._arrived.clear()
            await self._arrived.wait()
        return found

    def of(self, kind: type[W]) -> list[W]:
        """Return all messages of one kind."""
        return [message for message in self.heard if isinstance(message, kind)]

    async def close(self) -> None:
        for subscription in self._subscriptions:
            await subscription.close()
        await asyncio.gather(*self._tasks)

    async def _hear(self, samples: Subscription[Sample]) -> None:
        async for sample in samples:
            self.heard.append(decode(sample.payload))
            self._arrived.set()


@pytest.fixture
def broker() -> MemoryBroker:
    return MemoryBroker()


@pytest.fixture
async def host(broker: MemoryBroker) -> AsyncIterator[Host]:
    made = Host(broker.session())
    await made.listen()
    yield made
    await made.close()


@pytest.fixture
def result() -> Callable[[int], Result]:
    def make(episode: int = 0) -> Result:
        nothing = Casualties(units=0, value=0)
        return Result(
            run=RUN,
            episode=episode,
            outcome="draw",
            cause="time limit",
            steps=1,
            game_loop=8,
            game_s=0.4,
            wall_s=0.1,
            killed=nothing,
            lost=nothing,
            kd=None,
        )

    return make


# --- a model that answers from a list -----------------------------------------------------------------


class ListedModel:
    """An `LLMClient`: a request takes the next entry: an answer, an error, or seconds that it takes before the next."""

    model, endpoint = "listed", "http://listed/v1"
    params: Mapping[str, str | int | float | bool | None] = {}
    answer_tokens: int | None = None

    def __init__(self, *entries: str | Completion | LLMError | float) -> None:
        self.entries = list(entries)
        self.requests: list[tuple[float, Request]] = []
        self.refreshed = 0
        self.closed = 0

    async def complete(self, request: Request) -> Completion:
        self.requests.append((asyncio.get_running_loop().time(), request))
        entry = self.entries.pop(0)
        if isinstance(entry, float):
            await asyncio.sleep(entry)
            entry = self.entries.pop(0)
        if isinstance(entry, LLMError):
            raise entry
        if isinstance(entry, Completion):
            return entry
        assert isinstance(entry, str)
        usage = Usage(requests=1, prompt_tokens=100, completion_tokens=10, cost_usd=0.5)
        return Completion(entry, usage)

    async def refresh(self) -> None:
        self.refreshed += 1

    async def close(self) -> None:
        self.closed += 1

    @property
    def times_s(self) -> list[float]:
        """Times of the requests."""
        return [round(at, 6) for at, _ in self.requests]


@pytest.fixture
def listed_model() -> Callable[..., ListedModel]:
    return ListedModel
