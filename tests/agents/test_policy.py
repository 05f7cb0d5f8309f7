"""What a policy is, what can become one, and its context of a decision; on a clock that jumps."""

from __future__ import annotations

import asyncio
import os
from typing import TYPE_CHECKING

import pytest

from khala_agents.policy import Context, FunctionPolicy, ObjectPolicy, Policy, as_policy

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_protocol.messages import Briefing, Observation

CLOCK = "jumps"


class Echo(Policy):
    async def decide(self, context: Context) -> str:
        return context.observation.text


class Plain:
    def __init__(self) -> None:
        self.calls: list[str] = []

    def prepare(self, briefing: Briefing) -> None:
        self.calls.append(f"prepare {briefing.episode}")

    async def decide(self, briefing: Briefing, observation: Observation) -> str:
        return f"{briefing.agent}: {observation.text}"

    async def close(self) -> None:
        self.calls.append("close")


def blocking(briefing: Briefing, observation: Observation) -> str:
    return f"{briefing.agent}: {observation.text}"


async def waiting(briefing: Briefing, observation: Observation) -> str:
    return f"{briefing.agent}: {observation.text}"


@pytest.mark.parametrize(
    ("thing", "kind"),
    [(blocking, FunctionPolicy), (waiting, FunctionPolicy), (Plain(), ObjectPolicy)],
    ids=["function", "async function", "object"],
)
async def test_what_takes_briefing_and_observation_is_made_a_policy(
    thing: object, kind: type[Policy], briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy = as_policy(thing)
    assert type(policy) is kind
    assert await policy.decide(Context(briefing(), observation())) == "Stalkers: step 0"


async def test_a_policy_stays_what_it_is_and_needs_only_to_decide(
    briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    echo = Echo()
    assert as_policy(echo) is echo
    await echo.check()
    await echo.prepare(briefing())
    assert await echo.decide(Context(briefing(), observation())) == "step 0"
    await echo.close()


async def test_an_object_is_prepared_and_closed_if_it_can_be(briefing: Callable[..., Briefing]) -> None:
    plain = Plain()
    policy = as_policy(plain)
    await policy.prepare(briefing(episode=3))
    await policy.close()
    assert plain.calls == ["prepare 3", "close"]


def test_what_cannot_decide_is_no_policy() -> None:
    with pytest.raises(TypeError, match="it is no function and has no method `decide`"):
        as_policy(3)


class OfContext:
    def decide(self, context: Context) -> str:
        return context.observation.text


class OfText:
    decide = "Attack"


@pytest.mark.parametrize(
    ("thing", "begins"),
    [
        (os.system, r"it takes \(command\): a function of a policy takes \(briefing, observation\)"),
        (OfContext(), r"its `decide` takes \(context\): .* is a subclass of khala_agents.policy.Policy"),
        (OfText(), r"its `decide` is no function: write decide\(briefing, observation\)"),
    ],
)
def test_what_takes_something_else_is_refused_with_what_is_expected(thing: object, begins: str) -> None:
    with pytest.raises(TypeError, match=begins):
        as_policy(thing)


def test_a_function_with_more_parameters_that_have_defaults_is_a_policy() -> None:
    assert isinstance(as_policy(lambda *seen, style="calm": f"{seen} {style}"), FunctionPolicy)


async def test_a_context_knows_how_much_time_is_left(
    briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    context = Context(briefing(), observation(within_s=10.0))
    assert (context.time_s, context.deadline, context.time_left_s) == (9.5, 9.5, 9.5)
    await asyncio.sleep(4)
    assert (context.deadline, context.time_left_s) == (9.5, 5.5)
    await asyncio.sleep(6)
    assert context.time_left_s == 0


async def test_without_a_deadline_there_is_no_end_to_the_time(
    briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    context = Context(briefing(), observation(within_s=None))
    assert (context.time_s, context.deadline, context.time_left_s) == (None, None, None)
