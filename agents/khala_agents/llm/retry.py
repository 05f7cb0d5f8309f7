"""When a failed try is repeated: after which errors, after what wait, how often, and never past the deadline.

The loop is tenacity's. Here are the table of statuses, the wait that respects `Retry-After` and the stop that
respects the deadline. An answer after the deadline would be paid for and discarded, so a wait that would end
after it is not begun: the error is raised at once, and the agent says early that it failed.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, TypeVar

from pydantic import Field
from tenacity import AsyncRetrying, RetryCallState, retry_if_exception, stop_after_attempt

from khala_agents.llm.client import EndpointUnavailable, LLMError
from khala_protocol.messages import Frozen

if TYPE_CHECKING:
    import random
    from collections.abc import Awaitable, Callable

T = TypeVar("T")

RETRIED_STATUSES = frozenset({408, 409, 429})
"""HTTP statuses below 500 that are retried; all from 500 to 599 are, including 529 ("overloaded")."""


class RetryRule(Frozen):
    """How often a failed try is repeated, and after what time.

    The wait before try i + 2 is min(base_s · 2^i, cap_s) + jitter, i = 0, 1, …, with jitter uniform in
    [0, jitter_s); it is as long as `Retry-After` says if that is longer. Form and numbers, five tries and eight seconds
    among them, are those of LLM-PySC2's code; its paper gives none.
    """

    tries: int = Field(default=5, ge=1)
    """Number of tries; 1 repeats nothing."""
    base_s: float = Field(default=1.0, ge=0)
    cap_s: float = Field(default=8.0, ge=0)
    jitter_s: float = Field(default=1.0, ge=0)


def is_retried(status: int) -> bool:
    """Return whether a request that was answered with this HTTP status is retried."""
    return status in RETRIED_STATUSES or 500 <= status <= 599


async def with_retries(
    attempt: Callable[[], Awaitable[T]], rule: RetryRule, *, deadline: float | None, rng: random.Random
) -> T:
    """Return the result of `attempt`, retried after an `LLMError` that may pass. Raise the error of the last try.

    Args:
        attempt: makes one try.
        rule: how often, and after what time.
        deadline: on the clock of the running loop; None for no deadline.
        rng: source of the jitter.
    """
    now = asyncio.get_running_loop().time

    def is_late(state: RetryCallState) -> bool:
        return deadline is not None and now() + state.upcoming_sleep >= deadline

    async def once() -> T:  # tenacity awaits only what it recognises as a coroutine function
        return await attempt()

    attempts = stop_after_attempt(rule.tries)
    loop = AsyncRetrying(
        sleep=asyncio.sleep,
        retry=retry_if_exception(_may_succeed_later),
        wait=_wait(rule, rng),
        stop=lambda state: attempts(state) or is_late(state),
        reraise=True,
    )
    return await loop(once)


def _may_succeed_later(error: BaseException) -> bool:
    return isinstance(error, LLMError) and error.retryable


def _wait(rule: RetryRule, rng: random.Random) -> Callable[[RetryCallState], float]:
    def wait_s(state: RetryCallState) -> float:
        error = state.outcome.exception() if state.outcome else None
        doubled = rule.base_s * 2.0 ** (state.attempt_number - 1)
        backoff = min(doubled, rule.cap_s) + rng.random() * rule.jitter_s
        asked = error.retry_after_s if isinstance(error, EndpointUnavailable) else None
        return backoff if asked is None else max(backoff, asked)

    return wait_s
