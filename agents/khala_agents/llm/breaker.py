"""One memory of failures for all agents that ask an endpoint: after some in a row, none of them waits for it.

    breaker.check()             before a call: raises `EndpointAway` while the endpoint is given time to come back
    breaker.note(error)         after it: None, or how it failed

After `cool_down_s` one call is let through; if it succeeds, all are. Above it is `khala_agents.llm_policy`, which owns
the calls. It knows no HTTP.
"""

from __future__ import annotations

import asyncio

from pydantic import Field

from khala_agents.llm.client import LLMError, TryTimeout, Unreachable
from khala_protocol.messages import Frozen


class BreakerRule(Frozen):
    """When an endpoint is taken to be away. Failures are its own: 5xx, no connection, no answer in time."""

    failures: int = Field(default=10, ge=1, le=1000)
    """In a row, over all agents of a process."""
    cool_down_s: float = Field(default=5.0, gt=0, le=3600)
    """How long calls fail at once, until one tries again."""


class EndpointAway(LLMError):
    """The endpoint failed so often that it is not asked now."""

    may_be_billed = False

    def __init__(self, message: str) -> None:
        super().__init__(message, status="endpoint away")


class Breaker:
    """The state of one endpoint, for all agents of a process.

    Args:
        endpoint: its address, for errors.
        rule: when it is away.
    """

    def __init__(self, endpoint: str, rule: BreakerRule | None = None) -> None:
        self._endpoint = endpoint
        self._rule = rule or BreakerRule()
        self._failures = 0
        self._closed_until = 0.0

    def check(self) -> None:
        """Raise `EndpointAway` unless a call may be made; the first one after the cool-down is the only one."""
        if self._failures < self._rule.failures:
            return
        now = _now()
        if now < self._closed_until:
            raise EndpointAway(f"{self._endpoint} failed {self._failures} times in a row and is asked again later")
        self._closed_until = now + self._rule.cool_down_s

    def note(self, error: LLMError | None) -> None:
        """Note how a call ended; an endpoint that refuses a request is there."""
        if error is None or not is_away(error):
            self._failures = 0
            return
        self._failures += 1
        self._closed_until = _now() + self._rule.cool_down_s


def is_away(error: LLMError) -> bool:
    """Return whether an error says that the endpoint does not work, for whatever request."""
    return isinstance(error, Unreachable | TryTimeout) or error.status.startswith("http 5")


def _now() -> float:
    return asyncio.get_running_loop().time()
