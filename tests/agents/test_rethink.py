"""An agent that rethinks: what it sends on a verdict, what its model is asked, what its memory keeps; time jumps."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.config import WorkerSpec
from khala_agents.llm.client import RequestRefused
from khala_agents.llm_policy import LLMPolicy
from khala_agents.policy import Policy
from khala_agents.worker import run_worker
from khala_protocol.messages import MemoryRule, ModelCall, Verdict

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable

    from khala_agents.policy import Context
    from khala_protocol.bus.memory import MemoryBroker
    from khala_protocol.messages import Briefing, Observation

    Start = Callable[[Policy], Awaitable[None]]

CLOCK = "jumps"
RUN, SIDE, AGENT = "test", "blue", "Stalkers"
REFUSED = "Nothing of this answer can be carried out:\n    no action Fire"


@pytest.fixture
async def start(broker: MemoryBroker) -> AsyncIterator[Start]:
    """Start a worker with a policy."""
    stop = asyncio.Event()
    tasks = []

    async def begin(policy: Policy) -> None:
        tasks.append(asyncio.create_task(run_worker(broker.session(), RUN, SIDE, AGENT, policy, stop=stop)))
        await asyncio.sleep(0.001)

    yield begin
    stop.set()
    await asyncio.gather(*tasks)


def verdict_on(seen: Observation, number: int = 1) -> Observation:
    return seen.model_copy(update={"verdict": Verdict(number=number, text=REFUSED)})


async def test_a_verdict_is_shown_to_the_model_behind_its_answer_and_all_requests_are_booked(
    host: Any,
    start: Start,
    listed_model: Any,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    model = listed_model("<Fire()>", "<Stop()>", "<Hold()>")
    await start(LLMPolicy(model, rethink=1, memory=MemoryRule(steps=2, whole=True)))
    await host.say(briefing())
    await host.say(observation())
    await host.replies(1)
    await host.say(verdict_on(observation()))
    first, second = await host.replies(2)
    assert [(r.text, r.rethink, r.rethinks, r.attempts) for r in (first, second)] == [
        ("<Fire()>", 1, 0, 1),
        ("<Stop()>", 1, 1, 2),
    ]
    assert second.usage == first.usage + first.usage
    asked = [request.messages for _, request in model.requests]
    assert asked[1][: len(asked[0])] == asked[0]
    assert [(m.role, m.content) for m in asked[1][len(asked[0]) :]] == [("assistant", "<Fire()>"), ("user", REFUSED)]
    assert [call.attempt for call in host.of(ModelCall)] == [1, 2]
    await host.say(observation(step=1))
    await host.replies(3)
    before = model.requests[2][1].messages[-3:]
    assert [m.content for m in before] == ["step 0", "<Stop()>", "step 1"]  # the first answer is not remembered


async def test_an_answer_without_words_is_no_message_of_the_model(
    host: Any,
    start: Start,
    listed_model: Any,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    model = listed_model(" ", "<Stop()>")
    await start(LLMPolicy(model, rethink=1))
    await host.say(briefing())
    await host.say(observation())
    await host.replies(1)
    await host.say(verdict_on(observation()))
    await host.replies(2)
    last = model.requests[1][1].messages[-1]
    assert (last.role, last.content) == ("user", f"step 0\n\n{REFUSED}")


class Slow(Policy):
    """A policy that takes these times."""

    rethink = 1

    def __init__(self, *times_s: float) -> None:
        self._times_s = list(times_s)
        self.left_s: list[float | None] = []

    async def decide(self, context: Context) -> str:
        self.left_s.append(context.time_left_s)
        await asyncio.sleep(self._times_s.pop(0))
        return f"after {len(self.left_s)}"


async def test_a_second_thought_has_what_is_left_of_the_time_and_else_the_first_is_sent_again(
    host: Any, start: Start, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy = Slow(4, 20, 1)
    await start(policy)
    await host.say(briefing())
    await host.say(observation(within_s=10))
    (first,) = await host.replies(1)
    await host.say(verdict_on(observation(within_s=10)))
    _, second = await host.replies(2)
    assert policy.left_s == [pytest.approx(9.5), pytest.approx(5.5)]
    assert (first.text, first.rethinks) == ("after 1", 0)
    assert (second.text, second.status, second.rethinks, second.latency_s) == ("after 1", "ok", 1, pytest.approx(9.5))


async def test_an_answer_that_the_endpoint_fails_to_give_leaves_the_first_one(
    host: Any,
    start: Start,
    listed_model: Any,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    await start(LLMPolicy(listed_model("<Fire()>", RequestRefused("too long", status="http 400")), rethink=1))
    await host.say(briefing())
    await host.say(observation())
    await host.replies(1)
    await host.say(verdict_on(observation()))
    _, second = await host.replies(2)
    assert (second.text, second.status, second.rethinks, second.usage.requests) == ("<Fire()>", "ok", 1, 2)


async def test_an_agent_that_is_started_again_answers_the_verdict_that_it_finds(
    host: Any,
    start: Start,
    listed_model: Any,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    model = listed_model("<Stop()>")
    await host.say(briefing())
    await host.say(verdict_on(observation(step=3)))
    await start(LLMPolicy(model, rethink=1))
    (reply,) = await host.replies(1)
    assert (reply.step, reply.text, reply.rethinks) == (3, "<Stop()>", 1)
    assert model.requests[0][1].messages[-1].content == f"step 3\n\n{REFUSED}"


async def test_a_verdict_that_comes_twice_gets_the_same_reply_twice(
    host: Any,
    start: Start,
    listed_model: Any,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    await start(LLMPolicy(listed_model("<Fire()>", "<Stop()>"), rethink=1))
    await host.say(briefing())
    await host.say(observation())
    await host.replies(1)
    await host.say(verdict_on(observation()))
    await host.replies(2)
    await host.say(verdict_on(observation()))
    replies = await host.replies(3)
    assert [reply.text for reply in replies] == ["<Fire()>", "<Stop()>", "<Stop()>"]


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ({"policy": "skilled", "rethink": 1}, "rethink is for an agent with a model"),
        ({"model": "openai", "rethink": 4}, "less than or equal to 3"),
    ],
)
def test_a_file_of_agents_says_how_often_a_model_may_rethink(fields: dict[str, Any], fault: str) -> None:
    with pytest.raises(ValueError, match=fault):
        WorkerSpec.model_validate(fields)
