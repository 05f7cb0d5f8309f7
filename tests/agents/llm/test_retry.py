"""Which failures are retried, after what wait, and never past the deadline."""

from __future__ import annotations

import asyncio
import random
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.llm.client import (
    Completion,
    EndpointUnavailable,
    LimitExceeded,
    LLMError,
    MalformedCompletion,
    OutOfMoney,
    Request,
    RequestRefused,
    TryTimeout,
    Unauthorized,
    Unreachable,
)
from khala_agents.llm.faults import error_for, retry_after_s
from khala_agents.llm.retry import RetryRule, with_retries

if TYPE_CHECKING:
    from collections.abc import Callable

CLOCK = "jumps"
EXACT = RetryRule(tries=6, base_s=1, cap_s=8, jitter_s=0)
SPENT = b'{"error": {"message": "no quota left", "code": "insufficient_quota"}}'


def failing(model: Any) -> Callable[[], Any]:
    return lambda: model.complete(Request(()))


async def run(model: Any, rule: RetryRule = EXACT, deadline: float | None = None, seed: int = 0) -> Completion:
    return await with_retries(failing(model), rule, deadline=deadline, rng=random.Random(seed))


# status → error, retried; the list of `khala_agents.llm.retry` and `khala_agents.llm.http`, as a table
STATUSES = [
    (300, RequestRefused, False),
    (400, RequestRefused, False),
    (401, Unauthorized, False),
    (402, OutOfMoney, False),
    (403, Unauthorized, False),
    (404, RequestRefused, False),
    (408, EndpointUnavailable, True),
    (409, EndpointUnavailable, True),
    (413, RequestRefused, False),
    (422, RequestRefused, False),
    (429, EndpointUnavailable, True),
    (500, EndpointUnavailable, True),
    (502, EndpointUnavailable, True),
    (503, EndpointUnavailable, True),
    (504, EndpointUnavailable, True),
    (529, EndpointUnavailable, True),
]


@pytest.mark.parametrize(("status", "kind", "again"), STATUSES)
def test_an_http_status_is_this_error_and_tried_again_or_not(status: int, kind: type[LLMError], again: bool) -> None:
    error = error_for("http://host/v1", status, {}, b"")
    assert (type(error), error.retryable, error.status) == (kind, again, f"http {status}")


@pytest.mark.parametrize(
    "code", ["insufficient_quota", "billing_hard_limit_reached", "billing_not_active", "enforced_spend_limit_reached"]
)
def test_too_many_requests_is_final_when_the_money_is_gone(code: str) -> None:
    body = b'{"error": {"message": "you have no quota left", "code": "%s"}}' % code.encode()
    error = error_for("http://host/v1", 429, {"retry-after": "5"}, body)
    assert (type(error), error.retryable) == (OutOfMoney, False)


OTHERS = [
    (Unreachable("reset"), True),
    (TryTimeout("slow"), True),
    (MalformedCompletion("<html>"), True),
    (LimitExceeded("budget_usd", value=1, limit=1, source="the budget"), False),
    (ValueError("ours"), False),
    (asyncio.CancelledError(), False),
]


@pytest.mark.parametrize(("error", "again"), OTHERS, ids=[type(error).__name__ for error, _ in OTHERS])
async def test_an_error_is_tried_again_if_it_may_pass(error: BaseException, again: bool) -> None:
    tries = 0

    async def attempt() -> str:
        nonlocal tries
        tries += 1
        if tries == 1:
            raise error
        return "good"

    if again:
        assert await with_retries(attempt, EXACT, deadline=None, rng=random.Random(0)) == "good"
    else:
        with pytest.raises(type(error)):
            await with_retries(attempt, EXACT, deadline=None, rng=random.Random(0))
    assert tries == 1 + again


async def test_waits_double_up_to_the_cap(listed_model: Callable[..., Any]) -> None:
    model = listed_model(*[Unreachable("down")] * 5, "good")
    assert (await run(model)).text == "good"
    assert model.times_s == [0, 1, 3, 7, 15, 23]


async def test_jitter_is_added_to_every_wait(listed_model: Callable[..., Any]) -> None:
    model = listed_model(*[Unreachable("down")] * 4, "good")
    await run(model, RetryRule(tries=6, base_s=1, cap_s=2, jitter_s=1), seed=3)
    waits = [after - before for before, after in zip(model.times_s, model.times_s[1:], strict=False)]
    assert all(base <= wait < base + 1 for base, wait in zip((1, 2, 2, 2), waits, strict=True))
    assert len(set(waits)) == 4


async def test_the_last_error_is_raised_when_the_tries_are_used_up(listed_model: Callable[..., Any]) -> None:
    model = listed_model(Unreachable("one"), Unreachable("two"), Unreachable("three"))
    with pytest.raises(Unreachable, match="three"):
        await run(model, RetryRule(tries=3, jitter_s=0))
    assert model.times_s == [0, 1, 3]


RETRY_AFTER = [(0.0, 1.0), (0.5, 1.0), (5.0, 5.0)]


@pytest.mark.parametrize(("asked_s", "waited_s"), RETRY_AFTER)
async def test_retry_after_is_a_minimum(listed_model: Callable[..., Any], asked_s: float, waited_s: float) -> None:
    model = listed_model(EndpointUnavailable("busy", status="http 429", retry_after_s=asked_s), "good")
    await run(model)
    assert model.times_s == [0, waited_s]


# (deadline, Retry-After) → when the error is raised: no wait is begun that would end at or after the deadline
DEADLINES = [(100.0, None, 31.0), (7.5, None, 7.0), (7.0, None, 3.0), (1.0, None, 0.0), (60.0, 61.0, 0.0)]


@pytest.mark.parametrize(("deadline", "retry_after", "raised_at"), DEADLINES)
async def test_no_wait_is_begun_that_would_end_after_the_deadline(
    listed_model: Callable[..., Any], deadline: float, retry_after: float | None, raised_at: float
) -> None:
    busy = EndpointUnavailable("busy", status="http 503", retry_after_s=retry_after)
    model = listed_model(*[busy] * 9)
    with pytest.raises(EndpointUnavailable):
        await run(model, RetryRule(tries=7, jitter_s=0, cap_s=8), deadline=deadline)
    assert asyncio.get_running_loop().time() == raised_at


HEADERS = [
    ({}, None),
    ({"retry-after": "3"}, 3.0),
    ({"retry-after": "0.25"}, 0.25),
    ({"retry-after": "7200"}, 7200.0),
    ({"retry-after": "nan"}, None),
    ({"retry-after": "inf"}, None),
    ({"retry-after-ms": "nan", "retry-after": "9"}, 9.0),
    ({"retry-after": "-1"}, 0.0),
    ({"retry-after-ms": "1500", "retry-after": "9"}, 1.5),
    ({"retry-after-ms": "soon", "retry-after": "9"}, 9.0),
    ({"retry-after": "soon"}, None),
    ({"retry-after": "Wed, 21 Oct 2026 07:28:30 GMT", "date": "Wed, 21 Oct 2026 07:28:00 GMT"}, 30.0),
    ({"retry-after": "Wed, 21 Oct 2015 07:28:00 GMT"}, 0.0),
]


@pytest.mark.parametrize(("headers", "seconds"), HEADERS)
def test_retry_after_is_read_in_its_forms(headers: dict[str, str], seconds: float | None) -> None:
    assert retry_after_s(headers) == seconds
