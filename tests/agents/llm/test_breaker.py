"""When an endpoint is taken to be away, and when it is asked again; on a clock that jumps."""

from __future__ import annotations

import asyncio

import pytest

from khala_agents.llm.breaker import Breaker, BreakerRule, EndpointAway, is_away
from khala_agents.llm.client import (
    EndpointUnavailable,
    LLMError,
    MalformedCompletion,
    RequestRefused,
    TryTimeout,
    Unauthorized,
    Unreachable,
)

CLOCK = "jumps"
DOWN = Unreachable("refused")
RULE = BreakerRule(failures=3, cool_down_s=10)


def away(breaker: Breaker) -> bool:
    try:
        breaker.check()
    except EndpointAway:
        return True
    return False


async def test_after_failures_in_a_row_calls_fail_at_once_and_say_why() -> None:
    breaker = Breaker("http://x/v1", RULE)
    for _ in range(2):
        breaker.note(DOWN)
        assert not away(breaker)
    breaker.note(DOWN)
    with pytest.raises(EndpointAway) as caught:
        breaker.check()
    assert caught.value.status == "endpoint away"
    assert str(caught.value) == "http://x/v1 failed 3 times in a row and is asked again later"


@pytest.mark.parametrize("error", [None, RequestRefused("no", status="http 400")])
async def test_an_answer_of_any_kind_ends_the_row(error: LLMError | None) -> None:
    breaker = Breaker("http://x/v1", RULE)
    for outcome in (DOWN, DOWN, error, DOWN, DOWN):
        breaker.note(outcome)
    assert not away(breaker)


@pytest.mark.parametrize("ended", [None, DOWN])
async def test_after_the_cool_down_one_call_finds_out_for_all(ended: LLMError | None) -> None:
    breaker = Breaker("http://x/v1", RULE)
    for _ in range(3):
        breaker.note(DOWN)
    await asyncio.sleep(9.9)
    assert away(breaker)
    await asyncio.sleep(0.2)
    assert [away(breaker) for _ in range(3)] == [False, True, True]
    breaker.note(ended)
    assert away(breaker) == (ended is DOWN)


async def test_a_call_that_never_ends_does_not_keep_the_endpoint_away() -> None:
    breaker = Breaker("http://x/v1", RULE)
    for _ in range(3):
        breaker.note(DOWN)
    await asyncio.sleep(10)
    assert not away(breaker)  # cancelled, and never noted
    await asyncio.sleep(10)
    assert not away(breaker)


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (DOWN, True),
        (TryTimeout("late"), True),
        (EndpointUnavailable("", status="http 503"), True),
        (EndpointUnavailable("", status="http 429"), False),
        (MalformedCompletion("html"), False),
        (Unauthorized("", status="http 401"), False),
    ],
)
def test_only_failures_of_the_endpoint_count(error: LLMError, expected: bool) -> None:
    assert is_away(error) == expected
