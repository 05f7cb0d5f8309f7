"""A policy that decides where a model cannot: its endpoint is away, its money is used up, its answer is late.

The reply is marked `fallback`, with the reason and the name of the policy (`endpoint away: skilled`), so that a result
says in how many steps the model did not decide. Without a fallback, the host takes the default reply of the task
(`khala_orchestrator.match.replies`). Above it is `khala_agents.build`; below it are two policies of any
kind.
"""

from __future__ import annotations

import asyncio
import dataclasses
import logging
from typing import TYPE_CHECKING

from khala_agents.guard import without_model
from khala_agents.llm.client import LLMError, OutOfMoney
from khala_agents.policy import Decision, Policy

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_agents.policy import Context, Said
    from khala_protocol.messages import Briefing, Observation

log = logging.getLogger(__name__)

RESERVE_PART = 0.1
RESERVE_MOST_S = 1.0
"""Time that the model does not get, so that the other policy answers the same step; `skilled` takes some 20 ms."""


class Fallback(Policy):
    """The policy of an agent with a model and, without a reply of the model, of another policy.

    Args:
        model: asked first.
        other: asked if the model has no reply in time.
        name: of the other policy, for replies and the log.
    """

    def __init__(self, model: Policy, other: Policy, *, name: str) -> None:
        self.model = model
        self.pace = model.pace
        self.rethink = model.rethink
        self._other = other
        self._name = name
        self._complaints: set[str] = set()

    async def check(self) -> None:
        """Check both."""
        await self.model.check()
        await self._other.check()

    async def prepare(self, briefing: Briefing) -> None:
        """Prepare both for an episode."""
        await self._other.prepare(briefing)
        await self.model.prepare(briefing)

    def remember(self, decisions: Sequence[tuple[Observation, str]]) -> None:
        """Have both remember."""
        self.model.remember(decisions)
        self._other.remember(decisions)

    async def decide(self, context: Context) -> Said:
        """Return the model's reply, or else the other's, marked as a fallback."""
        hurried = dataclasses.replace(context, reserve_s=_reserve_s(context.time_s))
        try:
            async with asyncio.timeout_at(hurried.deadline):
                said = await self.model.decide(hurried)
            failure = said if isinstance(said, Decision) else Decision(said)
            if failure.status == "ok":
                return said
        except TimeoutError:
            failure = Decision("", "late", "timeout")
        except LLMError as error:
            failure = without_model(error)
            if isinstance(error, OutOfMoney):
                failure = dataclasses.replace(failure, detail="budget")
        self._complain(failure, context.observation.agent)
        said = await self._other.decide(context)
        decision = said if isinstance(said, Decision) else Decision(said)
        return dataclasses.replace(
            decision,
            status="fallback",
            detail=f"{failure.detail or failure.status}: {self._name}",
            reason=failure.reason,
            hopeless=failure.hopeless and failure.detail != "connection",  # an endpoint may come up later
        )

    async def reflect(self, context: Context) -> None:
        """Have both think on."""
        await self._other.reflect(context)
        await self.model.reflect(context)

    async def close(self) -> None:
        """Close both."""
        try:
            await self.model.close()
        finally:
            await self._other.close()

    def _complain(self, failure: Decision, agent: str) -> None:
        why = failure.detail or failure.status
        if why not in self._complaints:
            self._complaints.add(why)
            log.error("agent %s: no reply from the model, %s decides: %s", agent, self._name, failure.reason or why)


def _reserve_s(time_s: float | None) -> float:
    return 0.0 if time_s is None else min(RESERVE_PART * time_s, RESERVE_MOST_S)
