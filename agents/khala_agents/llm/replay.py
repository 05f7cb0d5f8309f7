"""Recorded completions in place of a model: the same prompts get the same answers, and the same failures.

A request is looked up by its agent, episode, step, purpose and attempt; its prompt must be exactly the recorded one.
Any difference is reported, because an answer to another question proves nothing. Nothing is waited for: a
request that was cut off by the deadline fails at once, so that the agent falls back as it did then.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, cast, get_args

from khala_agents.llm.client import (
    Completion,
    EndpointUnavailable,
    LLMError,
    MalformedCompletion,
    Request,
    RequestRefused,
    Scalar,
    TryTimeout,
    Unauthorized,
    Unreachable,
    prompt_sha256,
)
from khala_agents.llm.retry import is_retried
from khala_agents.llm.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_protocol.messages import ChatMessage, ModelCall


Key = tuple[str, int, int, str, int]
VERDICTS: Final[frozenset[str]] = frozenset(get_args(Verdict))


class NotRecorded(LLMError):
    """The recording has no such request, or one with another prompt."""

    may_be_billed = False

    def __init__(self, message: str) -> None:
        super().__init__(message, status="replay")


class ReplayClient:
    """An `LLMClient` that answers from recorded exchanges, of one agent or of several."""

    def __init__(self, exchanges: Iterable[ModelCall]) -> None:
        self._recorded: dict[Key, ModelCall] = {
            (e.agent, e.episode, e.step, e.purpose, e.attempt): e for e in exchanges
        }
        first = next(iter(self._recorded.values()), None)
        self.model = first.model if first else "replay"
        self.endpoint = first.endpoint if first else "recording"
        self.params: Mapping[str, Scalar] = dict(first.params) if first else {}
        self.answer_tokens: int | None = None

    async def complete(self, request: Request) -> Completion:
        """Return the recorded completion, or raise the recorded failure.

        Raises:
            NotRecorded: the request is not in the recording.
            LLMError: the recorded request failed.
        """
        exchange = self._look_up(request)
        if exchange.completion is not None:
            return Completion(
                exchange.completion,
                exchange.usage,
                finish=exchange.finish,
                model=exchange.answered_by,
                verdict=cast("Verdict", exchange.status) if exchange.status in VERDICTS else "ok",
                reason=exchange.reason,
                tokens=exchange.tokens,
            )
        *origin, attempt = _key(request)
        error = _failure(exchange)
        error.retryable = (*origin, attempt + 1) in self._recorded
        raise error

    async def check(self) -> None:
        """Find nothing wrong."""

    async def refresh(self) -> None:
        """Do nothing."""

    async def close(self) -> None:
        """Do nothing."""

    def _look_up(self, request: Request) -> ModelCall:
        agent, episode, step, purpose, attempt = key = _key(request)
        exchange = self._recorded.get(key)
        if exchange is None:
            what = "request" if purpose == "decision" else f"request for a {purpose}"
            raise NotRecorded(f"no {what} {attempt} of {agent} in episode {episode}, step {step} was recorded")
        if prompt_sha256(exchange.prompt) != prompt_sha256(request.messages):
            where = _difference(exchange.prompt, request.messages)
            raise NotRecorded(
                f"the prompt of {agent} in episode {episode}, step {step} is not the recorded one: {where}"
            )
        return exchange


def _failure(exchange: ModelCall) -> LLMError:
    """Return the failure that was recorded; of a request that was cancelled, that its time was over."""
    text = exchange.reason or f"recorded: {exchange.status}"
    status = exchange.status
    match status:
        case "timeout" | "cancelled":
            return TryTimeout(text)
        case "connection":
            return Unreachable(text)
        case "malformed":
            return MalformedCompletion(text)
        case "http 401" | "http 403":
            return Unauthorized(text, status=status)
    if status.startswith("http 4") and not is_retried(int(status.removeprefix("http "))):
        return RequestRefused(text, status=status)
    return EndpointUnavailable(text, status=status)


def _key(request: Request) -> Key:
    origin = request.origin
    if origin is None:
        raise NotRecorded("a request without its origin cannot be looked up")
    return origin.agent, origin.episode, origin.step, origin.purpose, request.attempt


def _difference(recorded: tuple[ChatMessage, ...], asked: tuple[ChatMessage, ...]) -> str:
    if len(recorded) != len(asked):
        return f"{len(recorded)} messages were recorded, {len(asked)} are sent"
    for index, (old, new) in enumerate(zip(recorded, asked, strict=True)):
        if old.role != new.role:
            return f"message {index} was of role {old.role}, and is of role {new.role}"
        if old.images != new.images:
            return f"message {index} was sent with {_names(old)}, and is with {_names(new)}"
        lines = zip(f"{old.content}\n".splitlines(), f"{new.content}\n".splitlines(), strict=False)
        for number, (before, after) in enumerate(lines, 1):
            if before != after:
                return f"message {index}, line {number} was {before!r}, and is {after!r}"
    return "its end differs"


def _names(message: ChatMessage) -> str:
    """Return the names of the pictures of a message."""
    return ", ".join(f"{image.name} {image.sha256[:8]}" for image in message.images) or "no pictures"
