"""Ask a policy, and return a reply in time whatever the policy does.

A policy is the user's code: it may raise, return nonsense, take too long, or ignore its cancellation.
Each of these becomes a `Decision` without a text, whose status says what happened; the host then takes the default
reply of the task (`khala_orchestrator.match.replies`). Above it: `khala_agents.worker`.
"""

from __future__ import annotations

import asyncio
import dataclasses
import logging
import traceback
from typing import TYPE_CHECKING, ParamSpec

from khala_agents.llm.client import LLMError, MalformedCompletion, TryTimeout
from khala_agents.policy import Decision, Said
from khala_agents.secret import scrub
from khala_protocol.messages import MAX_DETAIL_CHARACTERS, MAX_REPLY_CHARACTERS
from khala_protocol.visible import visible, visible_line

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine
    from typing import Any

    from khala_protocol.messages import ReplyStatus

P = ParamSpec("P")
log = logging.getLogger(__name__)

UNWIND_S = 0.02
"""Time that a cancelled policy has to report its spending, before an empty reply is sent."""


class Guard:
    """The guard between a worker and the policy of one agent.

    Args:
        agent: name of the agent, for the log.
    """

    def __init__(self, agent: str) -> None:
        self._agent = agent
        self._complaints: set[str] = set()
        self._abandoned: set[asyncio.Task[Said]] = set()

    async def within(self, time_s: float | None, deciding: Coroutine[Any, Any, Said]) -> Decision:
        """Return the decision, or `late` after `time_s` seconds. Raise only if cancelled or if the process ends."""
        task = asyncio.create_task(deciding, name=f"decide {self._agent}")
        try:
            done, _ = await asyncio.wait({task}, timeout=time_s)
            if not done:
                task.cancel()
                await asyncio.wait({task}, timeout=UNWIND_S)
                return Decision("", "late", "timeout")
        finally:
            self._let_go(task)
        return self._outcome(task)

    async def safely(
        self, what: str, function: Callable[P, Awaitable[None]], *args: P.args, **kwargs: P.kwargs
    ) -> None:
        """Run an optional part of a policy; log its failure."""
        try:
            await function(*args, **kwargs)
        except Exception as error:  # noqa: BLE001 - a policy is the user's code; it is logged, and the agent lives on
            self._complain(f"{what} failed", error)

    async def settle(self, timeout_s: float) -> None:
        """Wait until cancelled decisions have ended, or give up on them."""
        if self._abandoned:
            _, pending = await asyncio.wait(self._abandoned, timeout=timeout_s)
            if pending:
                log.warning("agent %s: %d decision(s) ignored their cancellation", self._agent, len(pending))

    def _outcome(self, task: asyncio.Task[Said]) -> Decision:
        if task.cancelled():
            return Decision("", "failed", "cancelled")
        error = task.exception()
        if isinstance(error, LLMError):
            self._complain_of_model(error)
            return self._check(without_model(error))
        if isinstance(error, Exception):
            self._complain("the policy failed", error)
            return self._check(Decision("", "failed", type(error).__name__, scrub(str(error))))
        return self._check(task.result())

    def _check(self, answer: object) -> Decision:
        if isinstance(answer, str):
            answer = Decision(answer)
        if not isinstance(answer, Decision):
            kind = type(answer).__name__
            self._once(f"the policy returned {kind}, a reply is a str or an khala_agents.policy.Decision")
            return Decision("", "failed", f"returned {kind}")
        text = answer.text[: MAX_REPLY_CHARACTERS + 1]  # by the last one the host sees that the reply was longer
        detail, reason = (_short(words) for words in (answer.detail, answer.reason))
        return dataclasses.replace(answer, text=_sendable(text), detail=detail, reason=reason)

    def _let_go(self, task: asyncio.Task[Said]) -> None:
        if not task.done():
            task.cancel()
            self._abandoned.add(task)
        task.add_done_callback(self._forget)  # also if it failed in the moment in which it was cancelled

    def _forget(self, task: asyncio.Task[Said]) -> None:
        self._abandoned.discard(task)
        if not task.cancelled():
            task.exception()  # retrieved here, so that asyncio does not report it as never retrieved

    def _complain_of_model(self, error: LLMError) -> None:
        self._once(f"no reply of the model: {error} (further errors '{error.status}' are not logged)")

    def _complain(self, what: str, error: Exception) -> None:
        frames = traceback.extract_tb(error.__traceback__)
        where = f" at {frames[-1].filename}:{frames[-1].lineno}" if frames else ""
        self._once(f"{what}: {type(error).__name__}: {scrub(str(error))}{where}", key=what + type(error).__name__)

    def _once(self, text: str, key: str | None = None) -> None:
        if (key or text) not in self._complaints:
            self._complaints.add(key or text)
            log.error("agent %s: %s", self._agent, visible(text))


def without_model(error: LLMError) -> Decision:
    """Return the decision of an agent whose model has no answer."""
    status: ReplyStatus
    match error:
        case TryTimeout():
            status = "late"
        case MalformedCompletion():
            status = "malformed"
        case _:
            status = "failed"
    return Decision("", status, error.status, scrub(str(error)), hopeless=error.hopeless)


def _short(words: str) -> str:
    return _sendable(visible_line(words))[:MAX_DETAIL_CHARACTERS]


def _sendable(text: str) -> str:
    """Return a text without lone surrogates, which cannot be sent."""
    return text if text.isascii() else text.encode("utf-8", "replace").decode("utf-8")
