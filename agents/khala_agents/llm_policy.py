"""The policy that asks a language model: prompt → tries within limits → the model's words.

Above it: the worker, which cancels it at the deadline. Below it: `khala_agents.prompt`, `khala_agents.memory`,
`khala_agents.summary` and `khala_agents.llm`. It knows no bus. Each try, even a failed or cancelled one, goes to the
trace of its context.
"""

from __future__ import annotations

import asyncio
import dataclasses
import logging
import random
from typing import TYPE_CHECKING, NamedTuple

from khala_agents.answers.form import AnswerRule
from khala_agents.answers.render import shape_for
from khala_agents.fitting import PromptTooLong
from khala_agents.llm.breaker import Breaker
from khala_agents.llm.client import (
    Completion,
    LLMClient,
    LLMError,
    Origin,
    Request,
    RequestRefused,
    TryTimeout,
    Unauthorized,
    Unreachable,
)
from khala_agents.llm.limits import RequestLimits
from khala_agents.llm.retry import RetryRule, with_retries
from khala_agents.llm.window import ContextWindow
from khala_agents.memory import NoMemory, PromptMemory, memory_of
from khala_agents.pictures import PATIENCE_S
from khala_agents.policy import Decision, Policy
from khala_agents.prompt import Prompt
from khala_agents.secret import excerpt
from khala_agents.summary import GameSummary
from khala_protocol.messages import MemoryRule, ModelCall, Usage

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from khala_agents.answers.form import AnswerShape
    from khala_agents.detail import Detail
    from khala_agents.fitting import DraftPrompt
    from khala_agents.llm.client import Scalar
    from khala_agents.llm.limits import Ticket
    from khala_agents.llm.vision import Vision
    from khala_agents.policy import Context, Said
    from khala_protocol.messages import Briefing, Observation, Pace, Purpose

log = logging.getLogger(__name__)

UNKNOWN = Usage(requests=1, unknown_requests=1)
UNBILLED = Usage(requests=1)

MOST_SHORTENED = 4
"""Refusals of one prompt as too long, after each of which it is made shorter."""
_LEAST_TRY_S = 45.0
_PATIENCE_S = 600.0


class LLMPolicy(Policy):
    """A policy that decides by asking a language model.

    One request of at most `try_timeout_s`, repeated as `retry` says, never past the deadline.

    Args:
        client: the model; closed with the policy.
        memory: what is carried from step to step: a rule, or a memory of yours; None: as the briefing says.
        retry: how often a failed try is repeated.
        limits: shared with other agents of the process.
        breaker: shared with the agents of the process that ask the same endpoint.
        try_timeout_s: time for one try; the time to the deadline if that is shorter. None: half of what the step gives,
            at least 45 s; 10 minutes without a deadline.
        vision: how the model sees; None if it does not see, and pictures are left out.
        pace: how fast the model is, for the clock `token`; None: the task says.
        answer: the form of its answers.
        rethink: how often it is asked again in a step, if nothing of its answer is possible.
        detail: how much its prompts say.
        window: its context; shared with the agents of the process that ask the same model.
        rng: jitter of the waits between tries.
    """

    def __init__(
        self,
        client: LLMClient,
        *,
        memory: PromptMemory | MemoryRule | None = None,
        retry: RetryRule | None = None,
        limits: RequestLimits | None = None,
        breaker: Breaker | None = None,
        try_timeout_s: float | None = None,
        vision: Vision | None = None,
        pace: Pace | None = None,
        answer: AnswerRule | None = None,
        rethink: int = 0,
        detail: Detail = "full",
        window: ContextWindow | None = None,
        rng: random.Random | None = None,
    ) -> None:
        self.client = client
        self.limits = limits or RequestLimits()
        self.breaker = breaker or Breaker(client.endpoint)
        self.try_timeout_s = try_timeout_s
        self.vision = vision
        self.pace = pace
        self.answer = answer or AnswerRule()
        self.rethink = rethink
        self.detail: Detail = detail
        self.window = window or ContextWindow(scale=self.limits.scale)
        self._before: tuple[tuple[Observation, str], ...] = ()
        self._warned_blind = False
        self._answered = False
        self._asked_again = False
        self._rule = memory if isinstance(memory, MemoryRule) else None
        self._own_memory = None if isinstance(memory, MemoryRule) else memory
        self._memory: PromptMemory = self._own_memory or NoMemory()
        self._summary = GameSummary(0)
        self._retry = retry or RetryRule()
        self._rng = rng or random.Random()
        self._prompt: tuple[Briefing, Prompt] | None = None
        self._unsettled: tuple[Observation, str] | None = None
        """The newest step, which the memory takes in once the agent can no longer rethink it."""
        self.newest = Tried()
        """The tries of the newest decision."""

    async def check(self) -> None:
        """Check that the endpoint accepts the key; leave no connection open, because nothing may close it later."""
        try:
            await self.client.check()
            await self.window.ask()
        finally:
            await self.client.close()

    async def prepare(self, briefing: Briefing) -> None:
        """Begin an episode: build the prompt, forget the last episode, open a fresh connection."""
        self._prompt_for(briefing)
        self._remember_for(briefing)
        await self.client.refresh()
        await self.window.ask()

    async def decide(self, context: Context) -> Said:
        """Return the model's words, or why there are none.

        Raises:
            LLMError: the last try failed; its error.
        """
        observation = context.observation
        pictures = await self._look(context)
        wanted = observation.images[: self.vision.max_images] if self.vision else ()
        prompt = self._prompt_for(context.briefing)
        if observation.verdict is None:
            self._settle()
            self._summary.begin_decision(observation)
        recalled = self._memory.recall(observation)
        draft = prompt.draft(
            observation.text,
            recalled=recalled.messages,
            summary=self._summary.above,
            steps=recalled.text,
            images=tuple(image for image in wanted if image.sha256 in pictures),
            missing=[image for image in wanted if image.sha256 not in pictures],
        )
        if observation.verdict is not None:
            draft = dataclasses.replace(draft, refused=context.refused, verdict=observation.verdict.text)
        shape = shape_for(self.answer, context.briefing, observation.view)
        completion = await self._complete(_Tries(self, context, draft, pictures, shape))
        if completion.verdict != "ok":
            return Decision("", completion.verdict, reason=completion.reason)
        self._note(observation, completion.text)
        if not self.rethink:
            self._settle()
        return Decision(completion.text, cut=True) if completion.cut else completion.text

    def remember(self, decisions: Sequence[tuple[Observation, str]]) -> None:
        """Have memory and summary begin with these steps, in the episode that they are of."""
        self._before = tuple(decisions)

    def _note(self, observation: Observation, reply: str) -> None:
        """Note what was decided, in place of what was decided on the same observation before."""
        self._unsettled = (observation, reply)
        self._summary.end_decision(observation, reply)

    def _settle(self) -> None:
        """Have the memory take in the newest step."""
        if self._unsettled is not None:
            self._memory.remember(*self._unsettled)
        self._unsettled = None

    async def reflect(self, context: Context) -> None:
        """Ask for a new summary of the game, if one is due, and once for the context of the model."""
        if self._answered and not self._asked_again:  # some servers load a model only when it is asked first
            self._asked_again = True
            await self.window.ask()
        if not self._summary.is_due:
            return
        summary = self._summary

        def trace(exchange: ModelCall) -> None:
            summary.note(exchange)
            context.trace(exchange)

        draft = self._prompt_for(context.briefing).draft(summary.ask(context.observation))
        asking = _Tries(self, dataclasses.replace(context, trace=trace), draft, {}, purpose="summary")
        try:
            await self._complete(asking)
        except LLMError as error:
            log.info("agent %s: no summary of the game: %s", context.observation.agent, error)

    async def _complete(self, tries: _Tries) -> Completion:
        """Return the model's answer; a prompt that is refused as too long is made shorter and sent again.

        Raises:
            LLMError: the last try failed; its error.
        """
        while True:
            try:
                completion = await with_retries(tries.once, self._retry, deadline=tries.deadline, rng=self._rng)
            except RequestRefused as error:  # a prompt may grow too long later; what is refused at first stays refused
                if tries.shorten(error):
                    continue
                error.hopeless = isinstance(error, Unauthorized) or not self._answered
                raise
            except Unreachable as error:  # nothing listens there: not once in all tries, and never before
                error.hopeless = not (self._answered or error.may_be_billed)
                raise
            self._answered = True
            return completion

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
        if self._prompt is None or (self._prompt[0] is not briefing and self._prompt[0] != briefing):
            self._prompt = (briefing, Prompt(briefing, self.answer.form, self.detail))
            self._remember_for(briefing)
        return self._prompt[1]

    def _remember_for(self, briefing: Briefing) -> None:
        """Begin with the memory that the configuration of the agent names, or else the task."""
        rule = self._rule or briefing.memory
        self._memory = self._own_memory or memory_of(rule)
        self._memory.clear()
        self._unsettled = None
        self._summary = GameSummary(0 if self._own_memory else rule.summary)
        for observation, reply in self._before:
            if observation.episode == briefing.episode:
                self._summary.begin_decision(observation)
                self._memory.recall(observation)  # which tells it what became of the step before
                self._note(observation, reply)
                self._settle()


class Tried(NamedTuple):
    """Tries of the newest decision, over all replies to its observation."""

    step: tuple[int, int] = (-1, -1)
    tries: int = 0


class _Outcome(NamedTuple):
    """What became of one try."""

    status: str
    completion: Completion | None = None
    reason: str = ""
    usage: Usage = UNKNOWN


class _Tries:
    """The tries of one decision or summary, counted and traced."""

    def __init__(
        self,
        policy: LLMPolicy,
        context: Context,
        draft: DraftPrompt,
        pictures: Mapping[str, bytes],
        shape: AnswerShape | None = None,
        *,
        purpose: Purpose = "decision",
    ) -> None:
        observation = context.observation
        self.deadline = context.deadline
        self._purpose: Purpose = purpose
        self._policy = policy
        self._context = context
        self._whole = draft
        self._draft = draft
        self._room: int | None = None
        self._origin = Origin(observation.agent, observation.episode, observation.step, purpose)
        self._pictures = pictures
        self._shape = shape
        self._made = policy.newest.tries if self._goes_on else 0
        self._shortened = 0
        self._clock = asyncio.get_running_loop().time

    def shorten(self, refusal: RequestRefused) -> bool:
        """Learn from a refusal; return whether the prompt was too long, so that the next try sends less of it."""
        if isinstance(refusal, PromptTooLong) or self._shortened == MOST_SHORTENED:
            return False
        self._shortened += 1
        return self._policy.window.learn(str(refusal), self._tokens, self._policy.client.answer_tokens)

    @property
    def _tokens(self) -> int:
        """The estimated tokens of the prompt, with the form of its answer."""
        return self._draft.tokens(self._policy.vision) + (self._shape.estimated_tokens if self._shape else 0)

    def _fit(self) -> None:
        """Make the prompt fit the context of the model."""
        policy = self._policy
        self._room = policy.window.room(policy.client.answer_tokens, self._origin, self._made + 1)
        if self._room is not None:
            beside = self._shape.estimated_tokens if self._shape else 0
            self._draft = self._whole.fit(max(self._room - beside, 0), policy.vision)

    async def once(self) -> Completion:
        """Make one try, as soon as the limits allow it and unless the endpoint is away."""
        policy = self._policy
        policy.breaker.check()
        answer_tokens = policy.client.answer_tokens
        self._fit()
        async with policy.limits.admit(
            tokens=self._tokens, answer_tokens=answer_tokens, deadline=self._context.deadline
        ) as ticket:
            self._made += 1
            self._count()
            began = self._clock()
            request = self._request(began)
            outcome = _Outcome("cancelled", usage=UNKNOWN + self._beside)
            try:
                completion = await self._complete(request)
                outcome = _Outcome(
                    completion.verdict, completion, completion.reason, self._with_beside(completion.usage)
                )
                ticket.settle(outcome.usage)
            except LLMError as error:
                usage = outcome.usage if error.may_be_billed and request.delivery.left else UNBILLED
                outcome = _Outcome(error.status, None, excerpt(str(error)), usage)
                ticket.settle(usage)
                raise
            except asyncio.CancelledError:
                if not request.delivery.left:
                    outcome = _Outcome("cancelled", usage=UNBILLED)
                    ticket.settle(UNBILLED)
                raise
            finally:
                self._trace(began, ticket, outcome)
            return completion

    @property
    def _step(self) -> tuple[int, int]:
        observation = self._context.observation
        return observation.episode, observation.step

    @property
    def _goes_on(self) -> bool:
        """Whether these are tries for a second reply to the same observation; they are numbered on."""
        is_again = self._purpose == "decision" and self._context.observation.verdict is not None
        return is_again and self._policy.newest.step == self._step

    def _count(self) -> None:
        if self._purpose == "decision":
            self._policy.newest = Tried(self._step, self._made)

    async def _complete(self, request: Request) -> Completion:
        """Return the completion; tell the breaker how the call ended."""
        breaker, deadline = self._policy.breaker, self._context.deadline
        try:
            completion = await self._policy.client.complete(request)
        except LLMError as error:
            breaker.note(error)
            raise
        except asyncio.CancelledError:
            if deadline is not None and self._clock() >= deadline:  # the deadline came before the timeout of the try
                breaker.note(TryTimeout("the decision was cancelled at its deadline"))
            raise
        breaker.note(None)
        return completion

    @property
    def _beside(self) -> Usage:
        """What a request has beside its tokens: pictures, and what was left out of its prompt."""
        draft, vision = self._draft, self._policy.vision
        return Usage(
            images=len(draft.images),
            image_tokens=sum(vision.image_tokens(image) for image in draft.images) if vision else 0,
            shortened_requests=1 if draft.left_out else 0,
            left_out=dict.fromkeys(draft.left_out, 1),
        )

    def _with_beside(self, usage: Usage) -> Usage:
        return usage if usage.images or usage.shortened_requests else usage + self._beside  # a recorded one has them

    def _request(self, now: float) -> Request:
        timeout_s = self._policy.try_timeout_s or _time_for_a_try(self._context.observation.answer_within_s)
        if self._context.deadline is not None:
            timeout_s = min(timeout_s, max(self._context.deadline - now, 0.0))
        return Request(
            self._draft.messages,
            timeout_s=timeout_s,
            origin=self._origin,
            attempt=self._made,
            pictures=self._pictures,
            stable=self._draft.stable,
            shape=self._shape,
        )

    def _params(self) -> dict[str, Scalar]:
        form = self._policy.answer.form
        return {**self._policy.client.params, **({"answer": form} if form != "text" and self._shape else {})}

    def _trace(self, began: float, ticket: Ticket, outcome: _Outcome) -> None:
        seen, completion, usage = self._context.observation, outcome.completion, outcome.usage
        if usage.unknown_requests:
            usage = usage.model_copy(update={"unknown_usd": ticket.most_usd})
        exchange = ModelCall(
            run=seen.run,
            agent=seen.agent,
            side=seen.side,
            episode=seen.episode,
            step=seen.step,
            purpose=self._purpose,
            attempt=self._made,
            model=self._policy.client.model,
            endpoint=self._policy.client.endpoint,
            prompt=self._draft.messages,
            left_out=self._draft.left_out,
            room_tokens=self._room if self._draft.left_out else None,
            params=self._params(),
            answered_by=completion.model if completion else "",
            completion=completion.text if completion else None,
            finish=completion.finish if completion else "",
            status=outcome.status,
            reason=outcome.reason,
            started_s=began - self._context.arrived,
            latency_s=self._clock() - began,
            waited_s=ticket.waited_s,
            usage=usage,
            tokens=completion.tokens if completion else None,
        )
        self._context.trace(exchange)


def _time_for_a_try(step_s: float | None) -> float:
    """Return the time for one request in a step that gives so long; None for as long as it takes."""
    return _PATIENCE_S if step_s is None else max(_LEAST_TRY_S, step_s / 2)
