"""An agent whose model is away plays on with another policy, in time, and says so; on a clock that jumps."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.build import Workshop, load_policy
from khala_agents.config import WorkerSpec
from khala_agents.fallback import Fallback
from khala_agents.llm.breaker import Breaker, BreakerRule
from khala_agents.llm.client import Completion, LLMError, OutOfMoney, Request, Unreachable
from khala_agents.llm.limits import RequestLimits
from khala_agents.llm.money import SharedBudget
from khala_agents.llm.pricing import Prices
from khala_agents.llm.retry import RetryRule
from khala_agents.llm_policy import LLMPolicy
from khala_agents.policy import Context, Decision
from khala_agents.scripted.players import Fixed, ScriptedPlayer
from khala_agents.worker import run_worker
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from khala_protocol.bus.memory import MemoryBroker
    from khala_protocol.messages import Briefing, Observation

CLOCK = "jumps"
OTHER = "Actions:\n    Team Stalker-1:\n        <Stop()>\n"
TEXT = (Path(__file__).parent / "scripted" / "observation.txt").read_text(encoding="utf-8")


class Unsteady:
    """An `LLMClient` that is up, refuses connections, or hangs."""

    model, endpoint = "unsteady", "http://unsteady/v1"
    params: Mapping[str, str | int | float | bool | None] = {}
    answer_tokens: int | None = None

    def __init__(self) -> None:
        self.state = "up"
        self.error: LLMError = Unreachable("refused")
        self.asked = 0

    async def complete(self, request: Request) -> Completion:
        self.asked += 1
        match self.state:
            case "up":
                return Completion("of the model", Usage(requests=1, prompt_tokens=1, completion_tokens=1, cost_usd=1.0))
            case "down":
                raise self.error
        await asyncio.Event().wait()
        raise AssertionError

    async def check(self) -> None: ...
    async def refresh(self) -> None: ...
    async def close(self) -> None: ...


@pytest.fixture
def client() -> Unsteady:
    return Unsteady()


@pytest.fixture
def policy(client: Unsteady) -> Fallback:
    breaker = Breaker(client.endpoint, BreakerRule(failures=2, cool_down_s=30))
    model = LLMPolicy(client, retry=RetryRule(tries=1), breaker=breaker)
    return Fallback(model, Fixed(OTHER), name="fixed")


async def test_an_endpoint_that_dies_in_a_match_costs_no_step_and_is_asked_again_when_it_is_back(
    client: Unsteady,
    policy: Fallback,
    host: Any,
    broker: MemoryBroker,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    stop, clock = asyncio.Event(), asyncio.get_running_loop().time
    playing = asyncio.create_task(run_worker(broker.session(), "test", "blue", "Stalkers", policy, stop=stop))
    await asyncio.sleep(0.001)
    await host.say(briefing())
    taken_s = []
    for step, state in enumerate(["up", "down", "hangs", "hangs", "hangs", "up"]):
        client.state = state
        if step == 5:
            await asyncio.sleep(30)
        began = clock()
        await host.say(observation(step=step))
        await host.replies(step + 1)
        taken_s.append(clock() - began)
    stop.set()
    tally = await playing
    assert [(reply.text, reply.status, reply.detail) for reply in await host.replies(6)] == [
        ("of the model", "ok", ""),
        (OTHER, "fallback", "connection: fixed"),
        (OTHER, "fallback", "timeout: fixed"),
        (OTHER, "fallback", "endpoint away: fixed"),
        (OTHER, "fallback", "endpoint away: fixed"),
        ("of the model", "ok", ""),
    ]
    assert [round(s, 2) for s in taken_s] == [0, 0, 8.55, 0, 0, 0]  # of 10 s: 0.5 are for sending, 0.95 for the other
    assert client.asked == 4, "an endpoint that is away is not asked"
    assert tally.undecided == {"connection: fixed": 1, "timeout: fixed": 1, "endpoint away: fixed": 2}


async def decided(policy: Fallback, briefing: Briefing, observation: Observation) -> tuple[str, str, str]:
    """Return text, status and detail of a decision."""
    decision = await policy.decide(Context(briefing, observation))
    assert isinstance(decision, Decision)
    return decision.text, decision.status, decision.detail


async def test_when_the_money_is_used_up_the_other_policy_decides(
    client: Unsteady, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    limits = RequestLimits(budget=SharedBudget(1.0), prices=Prices(prompt=1.0, completion=1.0))
    policy = Fallback(LLMPolicy(client, limits=limits), Fixed(OTHER), name="fixed")
    assert await policy.decide(Context(briefing(), observation())) == "of the model"
    assert await decided(policy, briefing(), observation(1)) == (OTHER, "fallback", "budget: fixed")
    client.state, client.error = "down", OutOfMoney("no credit", status="http 402")
    empty = Fallback(LLMPolicy(client), Fixed(OTHER), name="fixed")
    assert await decided(empty, briefing(), observation()) == (OTHER, "fallback", "budget: fixed")


async def test_agents_of_a_process_share_what_they_know_of_an_endpoint(
    briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    workshop = Workshop()
    one, two = (workshop.policy(WorkerSpec(model="scripted", fallback="silent")) for _ in range(2))
    assert isinstance(one, Fallback) and isinstance(two, Fallback)
    assert isinstance(one.model, LLMPolicy) and isinstance(two.model, LLMPolicy)
    assert one.model.breaker is two.model.breaker
    for _ in range(BreakerRule().failures):
        one.model.breaker.note(Unreachable("refused"))
    said = await two.decide(Context(briefing(), observation()))
    assert isinstance(said, Decision) and said.detail == "endpoint away: silent"


async def test_a_scripted_player_plays_in_the_process_of_its_agent(
    briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    player = load_policy("skilled")
    assert isinstance(player, ScriptedPlayer)
    context = Context(briefing(), observation(text=TEXT))
    said = await player.decide(context)
    assert "<Attack_Unit(" in str(said)
    assert await player.decide(context) == said


@pytest.mark.parametrize("name", ["silent", "skilled", "focus-fire", "random-legal"])
async def test_every_scripted_player_can_stand_in_for_a_model(
    name: str, client: Unsteady, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    client.state = "down"
    policy = Fallback(LLMPolicy(client, retry=RetryRule(tries=1)), load_policy(name), name=name)
    said = await policy.decide(Context(briefing(), observation(text=TEXT)))
    assert isinstance(said, Decision)
    assert (said.status, said.detail) == ("fallback", f"connection: {name}")
    assert said.text
