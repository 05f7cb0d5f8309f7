"""The policy that asks a model: tries, limits, memory, traces, and its replay."""

from __future__ import annotations

import asyncio
import random
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.build import replay_policies
from khala_agents.llm.client import (
    Completion,
    EndpointUnavailable,
    LimitExceeded,
    LLMError,
    Request,
    RequestRefused,
    Unauthorized,
    Unreachable,
)
from khala_agents.llm.limits import LimitRules, RequestLimits
from khala_agents.llm.money import SharedBudget
from khala_agents.llm.pricing import Prices
from khala_agents.llm.replay import NotRecorded
from khala_agents.llm.retry import RetryRule
from khala_agents.llm_policy import LLMPolicy
from khala_agents.memory import WholeSteps
from khala_agents.policy import Context, Decision, Said
from khala_protocol.codec import decode_as, encode
from khala_protocol.messages import ModelCall, Usage

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_agents.llm.verdict import Verdict
    from khala_protocol.messages import Briefing, Observation

CLOCK = "jumps"
BUSY = EndpointUnavailable("busy", status="http 429")
NO_JITTER = RetryRule(jitter_s=0)


@dataclass
class Asked:
    """A policy as a worker asks it, with a list of what is traced."""

    policy: LLMPolicy
    exchanges: list[ModelCall] = field(default_factory=list)

    async def decide(self, briefing: Briefing, observation: Observation) -> Said:
        return await self.policy.decide(Context(briefing, observation, trace=self.exchanges.append))


def traced(model: Any, **options: Any) -> tuple[Asked, list[ModelCall]]:
    asked = Asked(LLMPolicy(model, rng=random.Random(0), **({"retry": NO_JITTER} | options)))
    return asked, asked.exchanges


async def test_every_try_is_traced_with_its_times_and_what_it_took(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy, exchanges = traced(listed_model(BUSY, 2.0, Unreachable("torn"), 1.5, "Analysis: go."))
    assert await policy.decide(briefing(), observation(step=4, within_s=60.0)) == "Analysis: go."
    found = [(e.attempt, e.status, e.completion, e.started_s, e.latency_s) for e in exchanges]
    assert found == [
        (1, "http 429", None, 0, 0),
        (2, "connection", None, 1, 2),
        (3, "ok", "Analysis: go.", 5, 1.5),
    ]
    assert [e.usage for e in exchanges] == [
        Usage(requests=1),
        Usage(requests=1, unknown_requests=1),
        Usage(requests=1, prompt_tokens=100, completion_tokens=10, cost_usd=0.5),
    ]
    assert {(e.agent, e.step, e.model, e.endpoint) for e in exchanges} == {
        ("Stalkers", 4, "listed", "http://listed/v1")
    }
    assert exchanges[0].prompt[-1].content == "step 4"


async def test_a_try_gets_its_own_time_and_never_more_than_is_left(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = listed_model(BUSY, BUSY, BUSY, "good")
    policy, _ = traced(model, try_timeout_s=6.0)
    await policy.decide(briefing(), observation(within_s=10.0))
    assert [request.timeout_s for _, request in model.requests] == [6.0, 6.0, 6.0, 2.5]


@pytest.mark.parametrize(("within_s", "try_s"), [(300.0, 150.0), (60.0, 45.0), (None, 600.0)])
async def test_a_try_may_take_half_of_what_the_step_gives(
    within_s: float | None,
    try_s: float,
    listed_model: Callable[..., Any],
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    model = listed_model("good")
    policy, _ = traced(model)
    await policy.decide(briefing(), observation(within_s=within_s))
    assert [request.timeout_s for _, request in model.requests] == [try_s]


async def test_a_model_that_thinks_for_a_minute_answers_where_the_step_waits_for_it(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy, exchanges = traced(listed_model(60.0, "good"))
    assert await policy.decide(briefing(), observation(within_s=300.0)) == "good"
    assert [exchange.status for exchange in exchanges] == ["ok"]


async def test_no_try_is_begun_that_cannot_end_before_the_deadline(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = listed_model(*[BUSY] * 9)
    policy, exchanges = traced(model, retry=RetryRule(tries=9, jitter_s=0))
    with pytest.raises(EndpointUnavailable):
        await policy.decide(briefing(), observation(within_s=4.0))
    assert model.times_s == [0, 1, 3]
    assert len(exchanges) == 3


async def test_time_in_the_queue_of_the_limits_is_told_apart_from_the_request(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    limits = RequestLimits(LimitRules(in_flight=1))
    policies = [traced(listed_model(3.0, "good"), limits=limits) for _ in range(2)]
    await asyncio.gather(*(policy.decide(briefing(), observation()) for policy, _ in policies))
    assert [(e.waited_s, e.started_s, e.latency_s) for _, (e,) in policies] == [(0, 0, 3), (3, 3, 3)]


async def test_a_spent_budget_stops_requests_before_they_are_made(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    limits = RequestLimits(prices=Prices(prompt=1, completion=1), budget=SharedBudget(1.0))
    model = listed_model("one", "two", "three")
    policy, exchanges = traced(model, limits=limits)
    for step in range(2):
        await policy.decide(briefing(), observation(step))
    with pytest.raises(LimitExceeded, match="the budget is 1 USD"):
        await policy.decide(briefing(), observation(2))
    assert len(model.requests) == len(exchanges) == 2


async def test_memory_is_of_one_episode_and_of_answered_steps_only(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    model = listed_model("one", EndpointUnavailable("x", status="http 500"), "three", "four")
    policy, _ = traced(model, memory=WholeSteps(5), retry=RetryRule(tries=1))
    await policy.policy.prepare(briefing())
    await policy.decide(briefing(), observation(0))
    with pytest.raises(LLMError):
        await policy.decide(briefing(), observation(1))
    await policy.decide(briefing(), observation(2))
    assert [message.content for message in model.requests[2][1].messages[3:]] == ["step 0", "one", "step 2"]
    await policy.policy.prepare(briefing(episode=1))
    await policy.decide(briefing(episode=1), observation(0, episode=1))
    assert [message.content for message in model.requests[3][1].messages[3:]] == ["step 0"]


@pytest.mark.parametrize("verdict", ["empty", "cut", "refused", "filtered"])
async def test_an_answer_without_words_is_a_decision_that_nobody_made_with_the_reason(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation],
    verdict: Verdict,
) -> None:  # fmt: skip
    policy, exchanges = traced(
        listed_model(Completion("", verdict=verdict, reason="all 100 tokens were thoughts"), "go")
    )
    said = await policy.decide(briefing(), observation(0))
    assert said == Decision("", verdict, reason="all 100 tokens were thoughts")
    assert (exchanges[0].status, exchanges[0].reason) == (verdict, "all 100 tokens were thoughts")
    assert await policy.decide(briefing(), observation(1)) == "go"


@pytest.mark.parametrize(
    ("before", "error", "hopeless"),
    [
        ((), RequestRefused("no such model", status="http 404"), True),
        (("go",), RequestRefused("a word is not allowed", status="http 400"), False),
        (("go",), Unauthorized("revoked", status="http 401"), True),
        ((), EndpointUnavailable("busy", status="http 503"), False),
        ((), Unreachable("refused", sent=False), True),
        ((), Unreachable("torn"), False),
        (("go",), Unreachable("refused", sent=False), False),
    ],
)
async def test_a_refusal_that_no_later_request_can_escape_is_hopeless(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation],
    before: tuple[str, ...], error: LLMError, hopeless: bool,
) -> None:  # fmt: skip
    policy, _ = traced(listed_model(*before, error), retry=RetryRule(tries=1))
    for step in range(len(before)):
        await policy.decide(briefing(), observation(step))
    with pytest.raises(LLMError) as caught:
        await policy.decide(briefing(), observation(9))
    assert caught.value.hopeless == hopeless


async def test_a_request_of_unknown_usage_says_the_most_that_it_may_have_cost(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    limits = RequestLimits(prices=Prices(prompt=1.0, completion=1.0), budget=(budget := SharedBudget(1.0)))
    policy, exchanges = traced(listed_model(60.0, "too late"), limits=limits)
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(5):
            await policy.decide(briefing(), observation())
    (exchange,) = exchanges
    assert (exchange.status, exchange.usage.unknown_requests) == ("cancelled", 1)
    assert exchange.usage.unknown_usd == pytest.approx(budget.booked_usd)
    assert budget.booked_usd > 4_000e-6, "the longest answer, and the prompt"


async def test_a_request_that_never_left_costs_nothing(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    model = listed_model("never")

    async def connect(request: Request) -> Completion:
        request.delivery.left = False
        await asyncio.Event().wait()
        raise AssertionError

    monkeypatch.setattr(model, "complete", connect)
    limits = RequestLimits(prices=Prices(prompt=1.0, completion=1.0), budget=(budget := SharedBudget(1.0)))
    policy, exchanges = traced(model, limits=limits)
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(5):
            await policy.decide(briefing(), observation())
    assert (exchanges[0].status, exchanges[0].usage.unknown_requests, budget.booked_usd) == ("cancelled", 0, 0.0)


# --- replay ---------------------------------------------------------------------------------------------


async def test_recorded_exchanges_give_the_recorded_replies_without_a_wait(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy, exchanges = traced(listed_model(BUSY, 4.0, "first", Unreachable("x"), Unreachable("x"), 2.0, "second"))
    said = [await policy.decide(briefing(), observation(step, within_s=None)) for step in range(2)]
    recorded = [decode_as(ModelCall, encode(exchange)) for exchange in exchanges]
    began = asyncio.get_running_loop().time()
    replayed = Asked(replay_policies(recorded)["Stalkers"])
    assert [await replayed.decide(briefing(), observation(step, within_s=None)) for step in range(2)] == said
    assert asyncio.get_running_loop().time() == began
    assert [(e.status, e.completion, e.usage) for e in replayed.exchanges] == [
        (e.status, e.completion, e.usage) for e in exchanges
    ]


FINAL = ["http 429", "http 500", "connection", "timeout", "malformed"]


@pytest.mark.parametrize("status", FINAL)
async def test_a_failure_that_was_final_is_final_again(
    status: str, listed_model: Callable[..., Any], briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:  # fmt: skip
    failure = LLMError("final", status=status)
    policy, exchanges = traced(listed_model(failure))
    with pytest.raises(LLMError):
        await policy.decide(briefing(), observation())
    (replayed,) = replay_policies(exchanges).values()
    with pytest.raises(LLMError) as caught:
        await Asked(replayed).decide(briefing(), observation())
    assert (caught.value.status, caught.value.retryable) == (status, False)


async def test_a_request_that_the_deadline_cut_off_is_a_timeout_again(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy, exchanges = traced(listed_model(60.0, "never"))
    deciding = asyncio.create_task(policy.decide(briefing(), observation()))
    await asyncio.sleep(5)
    deciding.cancel()
    await asyncio.wait({deciding})
    assert [e.status for e in exchanges] == ["cancelled"]
    (replayed,) = replay_policies(exchanges).values()
    with pytest.raises(LLMError) as caught:
        await Asked(replayed).decide(briefing(), observation())
    assert caught.value.status == "timeout"


async def test_a_replay_says_what_differs_from_the_recording(
    listed_model: Callable[..., Any], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy, exchanges = traced(listed_model("one"))
    await policy.decide(briefing(), observation(0, text="Game\n    Time: 0:07"))
    (replayed,) = replay_policies(exchanges).values()
    where = "of Stalkers in episode 0, step 0"
    with pytest.raises(NotRecorded) as caught:
        await Asked(replayed).decide(briefing(), observation(0, text="Game\n    Time: 0:08"))
    assert str(caught.value) == (
        f"the prompt {where} is not the recorded one: message 3, line 2 was '    Time: 0:07', and is '    Time: 0:08'"
    )
    with pytest.raises(NotRecorded, match="no request 1 of Stalkers in episode 0, step 9 was recorded"):
        await Asked(replayed).decide(briefing(), observation(9))
