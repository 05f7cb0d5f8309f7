"""Pictures on the agent's side: kept by their hash, waited for in moderation, shown to models that see."""

from __future__ import annotations

import asyncio
import hashlib
import logging
from base64 import b64encode
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.build import replay_policies
from khala_agents.llm.limits import RequestLimits, Ticket
from khala_agents.llm.replay import NotRecorded
from khala_agents.llm.vision import ANTHROPIC, Vision
from khala_agents.llm_policy import LLMPolicy
from khala_agents.memory import WholeSteps
from khala_agents.pictures import PictureStore
from khala_agents.policy import Context, Policy, Said
from khala_agents.worker import run_worker
from khala_protocol.bus import Delivery
from khala_protocol.codec import decode_as, encode
from khala_protocol.keys import image_key
from khala_protocol.messages import ImageRef, ModelCall

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Mapping

    from khala_protocol.bus.memory import MemoryBroker
    from khala_protocol.messages import Briefing, Observation

CLOCK = "jumps"
RUN, SIDE, AGENT = "test", "blue", "Stalkers"
ONE, TWO, THREE = b"picture one", b"picture two", b"picture three"
SEES = Vision(tokens=ANTHROPIC)


def ref(data: bytes, name: str = "screen") -> ImageRef:
    return ImageRef(
        name=name,
        media_type="image/jpeg",
        sha256=hashlib.sha256(data).hexdigest(),
        title=f"The {name}.",
        width=512,
        height=512,
        bytes=len(data),
    )


def by_hash(*pictures: bytes) -> dict[str, bytes]:
    return {hashlib.sha256(data).hexdigest(): data for data in pictures}


# --- keeping ------------------------------------------------------------------------------------------


async def test_pictures_that_are_there_are_had_at_once() -> None:
    pictures = PictureStore()
    for data in (ONE, TWO, THREE):
        await pictures.put(data)
    began = asyncio.get_running_loop().time()
    assert await pictures.get([ref(TWO), ref(ONE)]) == by_hash(ONE, TWO)
    assert asyncio.get_running_loop().time() == began


async def test_a_picture_that_is_on_its_way_is_waited_for() -> None:
    pictures = PictureStore()
    waiting = asyncio.create_task(pictures.get([ref(ONE), ref(TWO)], within_s=0.5))
    await asyncio.sleep(0.1)
    await pictures.put(ONE)
    await asyncio.sleep(0.2)
    assert not waiting.done()
    await pictures.put(TWO)
    assert await waiting == by_hash(ONE, TWO)
    assert asyncio.get_running_loop().time() == pytest.approx(0.3)


async def test_what_does_not_come_in_time_is_left_out() -> None:
    pictures = PictureStore()
    await pictures.put(ONE)
    assert await pictures.get([ref(ONE), ref(TWO)], within_s=0.5) == by_hash(ONE)
    assert asyncio.get_running_loop().time() == pytest.approx(0.5)


async def test_the_oldest_are_forgotten_when_there_are_too_many() -> None:
    pictures = PictureStore(most_bytes=len(ONE) + len(TWO) + len(THREE) - 1)
    for data in (ONE, TWO, ONE, THREE):  # the second time makes the first one new
        await pictures.put(data)
    assert await pictures.get([ref(ONE), ref(TWO), ref(THREE)], within_s=0) == by_hash(ONE, THREE)


async def test_a_picture_that_is_too_large_alone_is_kept_until_the_next() -> None:
    pictures = PictureStore(most_bytes=3)
    await pictures.put(ONE)
    assert await pictures.get([ref(ONE)], within_s=0) == by_hash(ONE)
    await pictures.put(TWO)
    assert await pictures.get([ref(ONE), ref(TWO)], within_s=0) == by_hash(TWO)


# --- the policy ---------------------------------------------------------------------------------------


@dataclass
class Asked:
    """A policy as a worker asks it: with one place for pictures and one list of what is traced."""

    policy: LLMPolicy
    pictures: PictureStore = field(default_factory=PictureStore)
    exchanges: list[ModelCall] = field(default_factory=list)

    async def decide(self, briefing: Briefing, observation: Observation) -> Said:
        return await self.policy.decide(Context(briefing, observation, self.pictures, self.exchanges.append))


def policy_of(model: Any, **options: Any) -> tuple[Asked, list[ModelCall]]:
    asked = Asked(LLMPolicy(model, **({"vision": SEES} | options)))
    return asked, asked.exchanges


async def test_a_model_that_sees_is_shown_the_pictures_of_its_observation(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = listed_model("go")
    policy, exchanges = policy_of(model)
    for data in (ONE, TWO):
        await policy.pictures.put(data)
    shown = (ref(ONE), ref(TWO, "minimap"))
    await policy.decide(briefing(), observation(images=shown))
    ((_, request),) = model.requests
    assert request.messages[-1].images == shown
    assert request.messages[-1].content == "step 0"
    assert request.pictures == by_hash(ONE, TWO)
    assert (exchanges[0].usage.images, exchanges[0].usage.image_tokens) == (2, 700)
    assert exchanges[0].usage.prompt_tokens == 100  # as the endpoint counted


class Counting(RequestLimits):
    """Limits that note how many tokens a request is expected to take."""

    def __init__(self) -> None:
        super().__init__()
        self.tokens: list[int] = []

    @asynccontextmanager
    async def admit(self, *, tokens: int, answer_tokens: int | None, deadline: float | None) -> AsyncIterator[Ticket]:
        self.tokens.append(tokens)
        async with super().admit(tokens=tokens, answer_tokens=answer_tokens, deadline=deadline) as ticket:
            yield ticket


async def test_the_shared_limits_expect_the_tokens_of_pictures(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    limits = Counting()
    policy, _ = policy_of(listed_model("go", "on"), limits=limits)
    await policy.pictures.put(ONE)
    await policy.decide(briefing(), observation(0))
    await policy.decide(briefing(), observation(1, images=(ref(ONE),)))
    plain, with_picture = limits.tokens
    assert with_picture - plain == 350 + 3  # 512 x 512 / 750, and the title "The screen."


async def test_an_exchange_names_pictures_and_never_holds_one(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy, exchanges = policy_of(listed_model("go"))
    await policy.pictures.put(ONE)
    await policy.decide(briefing(), observation(images=(ref(ONE),)))
    sent = encode(exchanges[0])
    assert exchanges[0].prompt[-1].images == (ref(ONE),)
    assert ONE not in sent
    assert b64encode(ONE) not in sent


async def test_a_lost_picture_is_told_of_and_not_waited_for_long(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = listed_model("go")
    policy, exchanges = policy_of(model)
    await policy.pictures.put(ONE)
    await policy.decide(briefing(), observation(images=(ref(ONE), ref(TWO, "minimap"))))
    ((at_s, request),) = model.requests
    assert at_s == pytest.approx(0.5)
    assert request.messages[-1].images == (ref(ONE),)
    assert request.messages[-1].content == "Not shown, for it did not arrive: The minimap.\n\nstep 0"
    assert exchanges[0].usage.images == 1


async def test_waiting_for_pictures_takes_no_more_than_a_quarter_of_the_time_and_counts(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = listed_model("go")
    policy, exchanges = policy_of(model)
    await policy.decide(briefing(), observation(images=(ref(ONE),), within_s=1.0))
    ((at_s, request),) = model.requests
    assert at_s == pytest.approx(0.95 / 4)
    assert request.timeout_s == pytest.approx(0.95 * 3 / 4)  # never past the deadline
    assert exchanges[0].started_s == pytest.approx(0.95 / 4)


async def test_a_model_that_does_not_see_is_sent_none_and_that_is_said_once(
    listed_model: Callable[..., Any],
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
    caplog: pytest.LogCaptureFixture,
) -> None:
    model = listed_model("go", "on")
    policy, exchanges = policy_of(model, vision=None)
    await policy.pictures.put(ONE)
    with caplog.at_level(logging.WARNING):
        for step in range(2):
            await policy.decide(briefing(), observation(step, images=(ref(ONE),)))
    assert [request.messages[-1].images for _, request in model.requests] == [(), ()]
    assert model.times_s == [0, 0]
    (record,) = caplog.records
    assert record.message == (
        "agent Stalkers: its observations have pictures, and the model listed is shown none of them: "
        "say `images: true` in its model file if it sees"
    )
    assert exchanges[0].usage.images == 0


async def test_no_more_pictures_are_sent_than_a_model_takes(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = listed_model("go")
    policy, _ = policy_of(model, vision=Vision(max_images=1))
    await policy.decide(briefing(), observation(images=(ref(ONE), ref(TWO)), within_s=None))
    assert model.requests[0][1].messages[-1].content.count("did not arrive") == 1


async def test_remembered_steps_have_no_pictures(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = listed_model("go", "on")
    policy, _ = policy_of(model, memory=WholeSteps(2))
    await policy.pictures.put(ONE)
    for step in range(2):
        await policy.decide(briefing(), observation(step, images=(ref(ONE),)))
    assert [len(message.images) for message in model.requests[1][1].messages] == [0, 0, 0, 0, 0, 1]


async def test_recorded_prompts_with_pictures_get_their_recorded_answers(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy, exchanges = policy_of(listed_model("go"))
    await policy.pictures.put(ONE)
    await policy.decide(briefing(), observation(images=(ref(ONE),)))
    recorded = [decode_as(ModelCall, encode(exchange)) for exchange in exchanges]
    replayed = Asked(replay_policies(recorded)["Stalkers"])
    await replayed.pictures.put(ONE)
    assert await replayed.decide(briefing(), observation(images=(ref(ONE),))) == "go"
    assert replayed.exchanges[0].usage == exchanges[0].usage
    await replayed.pictures.put(TWO)
    with pytest.raises(
        NotRecorded, match=r"message 3 was sent with screen [0-9a-f]{8}, and is with screen [0-9a-f]{8}"
    ):
        await replayed.decide(briefing(), observation(images=(ref(TWO),)))


# --- the worker ---------------------------------------------------------------------------------------


class Looking(Policy):
    """A policy that notes what it sees."""

    def __init__(self) -> None:
        self.seen: list[Mapping[str, bytes]] = []

    async def decide(self, context: Context) -> str:
        self.seen.append(await context.pictures.get(context.observation.images))
        return "Analysis: I look."


async def show(bus: Any, place: int, data: bytes) -> None:
    publisher = await bus.publisher(image_key(RUN, SIDE, AGENT, place), Delivery.STATE)
    await publisher.put(data)


@pytest.mark.parametrize("joins_late", [False, True])
async def test_a_worker_hands_pictures_to_a_policy_that_looks(
    broker: MemoryBroker,
    host: Any,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
    joins_late: bool,
) -> None:
    policy, stop = Looking(), asyncio.Event()

    async def play() -> None:
        await run_worker(broker.session(), RUN, SIDE, AGENT, policy, stop=stop)

    worker = None if joins_late else asyncio.create_task(play())
    await asyncio.sleep(0.01)
    await show(host.bus, 0, ONE)
    await show(host.bus, 1, TWO)
    await host.say(briefing())
    await host.say(observation(images=(ref(ONE), ref(TWO))))
    worker = worker or asyncio.create_task(play())
    (reply,) = await host.replies(1)
    assert reply.text == "Analysis: I look."
    assert policy.seen == [by_hash(ONE, TWO)]
    stop.set()
    await worker


async def test_a_picture_that_comes_after_its_observation_is_in_time(
    broker: MemoryBroker, host: Any, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy, stop = Looking(), asyncio.Event()
    worker = asyncio.create_task(run_worker(broker.session(), RUN, SIDE, AGENT, policy, stop=stop))
    await asyncio.sleep(0.01)
    await host.say(briefing())
    await host.say(observation(images=(ref(ONE),)))
    await asyncio.sleep(0.2)
    await show(host.bus, 0, ONE)
    await host.replies(1)
    assert policy.seen == [by_hash(ONE)]
    stop.set()
    await worker
