"""The policy that asks a language model: prompt → tries within limits → the model's words.

Above it: the worker, which cancels it at the deadline. Below it: `khala_agents.prompt`, `khala_agents.memory` and
`khala_agents.llm`. It knows no bus. Each try, even a failed or cancelled one, goes to the trace of its context.
"""

from __future__ import annotations

import asyncio
import logging
import random
from typing import TYPE_CHECKING

from khala_agents.llm.breaker import Breaker
from khala_agents.llm.client import (
    Completion,
    LLMClient,
    LLMError,
    Origin,
    Request,
    TryTimeout,
    estimated_image_tokens,
    estimated_tokens,
)
from khala_agents.llm.limits import Limits
from khala_agents.llm.retry import RetryRule, retried
from khala_agents.memory import Memory, NoMemory
from khala_agents.pictures import PATIENCE_S
from khala_agents.policy import Policy
from khala_agents.prompt import Prompt
from khala_protocol.messages import ModelCall, Usage

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.llm.vision import Vision
    from khala_agents.policy import Context
    from khala_protocol.messages import Briefing, ChatMessage, Pace

log = logging.getLogger(__name__)

UNKNOWN = Usage(requests=1, unknown_requests=1)


class LLMPolicy(Policy):
    """A policy that decides by asking a language model.

    One request of at most `try_timeout_s`, repeated as `retry` says, never past the deadline.

    Args:
        client: the model; closed with the policy.
        memory: what is carried from step to step.
        retry: how often a failed try is repeated.
        limits: shared with other agents of the process.
        breaker: shared with the agents of the process that ask the same endpoint.
        try_timeout_s: time for one try; the time to the deadline if that is shorter.
        vision: how the model sees; None if it does not see, and pictures are left out.
        pace: how fast the model is, for the clock `token`; None: the task says.
        rng: jitter of the waits between tries.
    """

    def __init__(
        self,
        client: LLMClient,
        *,
        memory: Memory | None = None,
        retry: RetryRule | None = None,
        limits: Limits | None = None,
        breaker: Breaker | None = None,
        try_timeout_s: float = 45.0,
        vision: Vision | None = None,
        pace: Pace | None = None,
        rng: random.Random | None = None,
    ) -> None:
        self.client = client
        self.limits = limits or Limits()
        self.breaker = breaker or Breaker(client.endpoint)
        self.try_timeout_s = try_timeout_s
        self.vision = vision
        self.pace = pace
        self._warned_blind = False
        self._memory = memory or NoMemory()
        self._retry = retry or RetryRule()
        self._rng = rng or random.Random()
        self._prompt: tuple[Briefing, Prompt] | None = None

    async def check(self) -> None:
        """Check that the endpoint accepts the key; leave no connection open, because nothing may close it later."""
        try:
            await self.client.check()
        finally:
            await self.client.close()

    async def prepare(self, briefing: Briefing) -> None:
        """Begin an episode: build the prompt, forget the last episode, open a fresh connection."""
        self._prompt_for(briefing)
        self._memory.clear()
        await self.client.refresh()

    async def decide(self, context: Context) -> str:
        """Return the model's words.

        Raises:
            LLMError: the last try failed; its error.
        """
        observation = context.observation
        pictures = await self._look(context)
        wanted = observation.images[: self.vision.max_images] if self.vision else ()
        prompt = self._prompt_for(context.briefing).messages(
            observation.text,
            self._memory.recall(),
            images=tuple(image for image in wanted if image.sha256 in pictures),
            missing=[image for image in wanted if image.sha256 not in pictures],
        )
        tries = _Tries(self, context, prompt, pictures)
        completion = await retried(tries.once, self._retry, deadline=context.deadline, rng=self._rng)
        self._memory.remember(observation, completion.text)
        return completion.text

    async def close(self) -> None:
        """Close the client."""
        await self.client.close()

    async def _look(self, context: Context) -> Mapping[str, bytes]:
        """Return an observation's pictures that arrived, or arrive in a moment; none for a model that does not see."""
        observation = context.observation
        if not observation.images:
            return {}
        if self.vision is None:
            if not self._warned_blind:
                log.warning(
                    "agent %s: its observations have pictures, and the model %s is shown none of them: "
                    "say `images: true` in its model file if it sees",
                    observation.agent,
                    self.client.model,
                )
            self._warned_blind = True
            return {}
        patience_s = PATIENCE_S if context.time_s is None else min(PATIENCE_S, context.time_s / 4)
        return await context.pictures.get(observation.images[: self.vision.max_images], patience_s)

    def _prompt_for(self, briefing: Briefing) -> Prompt:
        if self._prompt is None or self._prompt[0] is not briefing:
            self._prompt = (briefing, Prompt(briefing))
        return self._prompt[1]


class _Tries:
    """The tries of one decision, counted and traced."""

    def __init__(
        self,
        policy: LLMPolicy,
        context: Context,
        prompt: tuple[ChatMessage, ...],
        pictures: Mapping[str, bytes],
    ) -> None:
        observation = context.observation
        self._policy = policy
        self._context = context
        self._prompt = prompt
        self._origin = Origin(observation.agent, observation.episode, observation.step)
        self._pictures = pictures
        self._tokens = estimated_tokens(prompt, policy.vision)
        self._images = Usage(
            images=sum(len(message.images) for message in prompt),
            image_tokens=estimated_image_tokens(prompt, policy.vision) if policy.vision else 0,
        )
        self._made = 0
        self._clock = asyncio.get_running_loop().time

    async def once(self) -> Completion:
        """Make one try, as soon as the limits allow it and unless the endpoint is away."""
        self._policy.breaker.check()
        async with self._policy.limits.admit(tokens=self._tokens, deadline=self._context.deadline) as ticket:
            self._made += 1
            began = self._clock()
            status, text, usage = "cancelled", None, UNKNOWN + self._images
            try:
                completion = await self._completed(began)
                status, text, usage = "ok", completion.text, self._with_images(completion.usage)
                ticket.settle(usage)
            except LLMError as error:
                status = error.status
                if not error.may_be_billed:
                    usage = Usage(requests=1)
                    ticket.settle(usage)
                raise
            finally:
                self._trace(began, ticket.waited_s, status, text, usage)
            return completion

    async def _completed(self, began: float) -> Completion:
        """Return the completion; tell the breaker how the call ended."""
        breaker, deadline = self._policy.breaker, self._context.deadline
        try:
            completion = await self._policy.client.complete(self._request(began))
        except LLMError as error:
            breaker.note(error)
            raise
        except asyncio.CancelledError:
            if deadline is not None and self._clock() >= deadline:  # the deadline came before the timeout of the try
                breaker.note(TryTimeout("the decision was cancelled at its deadline"))
            raise
        breaker.note(None)
        return completion

    def _with_images(self, usage: Usage) -> Usage:
        return usage if usage.images else usage + self._images  # a recorded one has them counted already

    def _request(self, now: float) -> Request:
        timeout_s = self._policy.try_timeout_s
        if self._context.deadline is not None:
            timeout_s = min(timeout_s, max(self._context.deadline - now, 0.0))
        return Request(
            self._prompt, timeout_s=timeout_s, origin=self._origin, attempt=self._made, pictures=self._pictures
        )

    def _trace(self, began: float, waited_s: float, status: str, text: str | None, usage: Usage) -> None:
        seen = self._context.observation
        exchange = ModelCall(
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
            started_s=began - self._context.arrived,
            latency_s=self._clock() - began,
            waited_s=waited_s,
            usage=usage,
        )
        self._context.trace(exchange)
