"""The policy that asks a language model: prompt → tries within limits → the model's words.

Above it: the worker, which cancels it at the deadline. Below it: `agents.prompt`, `agents.memory` and
`agents.llm`. It knows no bus; each try, also one that failed or was cancelled, is told to `trace`.
"""

from __future__ import annotations

import asyncio
import random
from typing import TYPE_CHECKING

from agents.deadline import time_to_decide_s
from agents.llm.client import Completion, LLMClient, LLMError, Origin, Request, estimated_tokens
from agents.llm.limits import Limits
from agents.llm.retry import RetryRule, retried
from agents.memory import Memory, NoMemory
from agents.prompt import Prompt
from protocol.messages import Exchange, Usage

if TYPE_CHECKING:
    from collections.abc import Callable

    from protocol.messages import Briefing, ChatMessage, Observation

UNKNOWN = Usage(requests=1, unknown_requests=1)


class LLMPolicy:
    """Decides by asking a language model.

    One request with `try_timeout_s` for it, repeated as `retry` says, never past the deadline.

    Args:
        client: the model; closed with the policy.
        memory: what is carried from step to step.
        retry: how often a failed try is repeated.
        limits: shared with other agents of the process.
        try_timeout_s: time for one try; the time to the deadline if that is shorter.
        rng: jitter of the waits between tries.

    Attributes:
        trace: called with every request that was made, as soon as it is over.
    """

    def __init__(
        self,
        client: LLMClient,
        *,
        memory: Memory | None = None,
        retry: RetryRule | None = None,
        limits: Limits | None = None,
        try_timeout_s: float = 45.0,
        rng: random.Random | None = None,
    ) -> None:
        self.trace: Callable[[Exchange], None] = _untold
        self.client = client
        self.limits = limits or Limits()
        self.try_timeout_s = try_timeout_s
        self._memory = memory or NoMemory()
        self._retry = retry or RetryRule()
        self._rng = rng or random.Random()
        self._prompt: tuple[Briefing, Prompt] | None = None

    async def check(self) -> None:
        """Makes sure that the endpoint takes the key; leaves no connection open, since nobody may come to close it."""
        try:
            await self.client.check()
        finally:
            await self.client.close()

    async def prepare(self, briefing: Briefing) -> None:
        """Begins an episode: builds the prompt, forgets the last one, opens a fresh connection."""
        self._prompt_for(briefing)
        self._memory.clear()
        await self.client.refresh()

    async def decide(self, briefing: Briefing, observation: Observation) -> str:
        """The model's words.

        Raises:
            LLMError: there are none; the error of the last try.
        """
        prompt = self._prompt_for(briefing).messages(observation.text, self._memory.recall())
        tries = _Tries(self, observation, prompt)
        completion = await retried(tries.once, self._retry, deadline=tries.deadline, rng=self._rng)
        self._memory.remember(observation, completion.text)
        return completion.text

    async def close(self) -> None:
        """Closes the client."""
        await self.client.close()

    def _prompt_for(self, briefing: Briefing) -> Prompt:
        if self._prompt is None or self._prompt[0] is not briefing:
            self._prompt = (briefing, Prompt(briefing))
        return self._prompt[1]


class _Tries:
    """The tries of one decision, counted and traced."""

    def __init__(self, policy: LLMPolicy, observation: Observation, prompt: tuple[ChatMessage, ...]) -> None:
        self._policy = policy
        self._observation = observation
        self._prompt = prompt
        self._origin = Origin(observation.agent, observation.episode, observation.step)
        self._tokens = estimated_tokens(prompt)
        self._made = 0
        self._clock = asyncio.get_running_loop().time
        self._arrived = self._clock()
        time_s = time_to_decide_s(observation.answer_within_s)
        self.deadline = None if time_s is None else self._arrived + time_s

    async def once(self) -> Completion:
        """Makes one try, as soon as the limits let it."""
        async with self._policy.limits.admit(tokens=self._tokens, deadline=self.deadline) as ticket:
            self._made += 1
            began = self._clock()
            status, text, usage = "cancelled", None, UNKNOWN
            try:
                completion = await self._policy.client.complete(self._request(began))
                status, text, usage = "ok", completion.text, completion.usage
                ticket.settle(usage)
            except LLMError as error:
                status = error.status
                if not error.may_be_billed:
                    usage = Usage(requests=1)
                    ticket.settle(usage)
                raise
            finally:
                self._tell(began, ticket.waited_s, status, text, usage)
            return completion

    def _request(self, now: float) -> Request:
        timeout_s = self._policy.try_timeout_s
        if self.deadline is not None:
            timeout_s = min(timeout_s, max(self.deadline - now, 0.0))
        return Request(self._prompt, timeout_s=timeout_s, origin=self._origin, attempt=self._made)

    def _tell(self, began: float, waited_s: float, status: str, text: str | None, usage: Usage) -> None:
        seen = self._observation
        exchange = Exchange(
            run=seen.run,
            agent=seen.agent,
            side=seen.side,
            episode=seen.episode,
            step=seen.step,
            attempt=self._made,
            model=self._policy.client.model,
            endpoint=self._policy.client.endpoint,
            prompt=self._prompt,
            params=dict(self._policy.client.params),
            completion=text,
            status=status,
            started_s=began - self._arrived,
            latency_s=self._clock() - began,
            waited_s=waited_s,
            usage=usage,
        )
        self._policy.trace(exchange)


def _untold(exchange: Exchange) -> None:
    """Nobody listens."""
