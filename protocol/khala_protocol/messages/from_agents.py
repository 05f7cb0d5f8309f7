"""What an agent says: its replies, and its requests to a model; and what an adviser says."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from khala_protocol.messages.base import Count, Frozen, Point, Wire
from khala_protocol.messages.to_agents import ImageRef
from khala_protocol.messages.usage import Pace, Usage
from khala_protocol.rethinks import MAX_RETHINKS

MAX_DETAIL_CHARACTERS = 200
"""Longest reason why an agent did not decide."""

MAX_REPLY_CHARACTERS = 65_536
"""The part of a reply that is read. Ordinary ones have at most some 10 000; a model that repeats itself goes on."""

MAX_ADVICE_CHARACTERS = 500
"""Longest message of an adviser."""

ReplyStatus = Literal[
    "ok",  # the agent decided
    "empty",  # its model answered without a word
    "cut",  # its model reached the limit of tokens before it said anything
    "refused",  # its model declined to answer
    "filtered",  # a filter of the endpoint took the answer away
    "malformed",  # its endpoint answered with no completion
    "failed",  # its endpoint or its policy failed
    "late",  # it did not decide in time
    "fallback",  # another policy decided in its place
]
"""Who decided; with any status but `ok` and `fallback`, nobody did, and the default reply of the task is played."""

Purpose = Literal["decision", "summary"]
"""What a model is asked for: a reply to an observation, or a summary of the steps so far (`MemoryRule.summary`)."""


class Call(Frozen):
    """One `<Name(args)>` found in a reply, with its place in the text."""

    name: str
    args: tuple[str | Point, ...] = ()
    """Tags as `0x…`, points as `(x, y)` in the frame that the action's catalogue entry says, the rest as text."""
    team: str | None = None
    """The team of the heading above it, as written there; None if there was no heading."""
    start: int = Field(ge=0)
    """Offset of `<` in the reply's text, in characters."""
    end: int = Field(ge=0)
    """Offset after `>`."""


class Reply(Wire):
    """Agent → host: the answer to one observation. The first valid one of a step counts; after a verdict, the next."""

    kind: Literal["reply"] = "reply"
    agent: str
    side: str
    episode: Count
    step: Count
    text: str
    """The reply as the model gave it. The host reads from it the agent's orders, messages and subscriptions."""
    status: ReplyStatus = "ok"
    detail: str = Field(default="", max_length=MAX_DETAIL_CHARACTERS)
    """Why the agent did not decide: `timeout`, `http 500`, `budget`, …; decisions are counted by it."""
    reason: str = Field(default="", max_length=MAX_DETAIL_CHARACTERS)
    """The same in the words of its endpoint or its policy."""
    hopeless: bool = False
    """Whether the agent's endpoint refuses it for good: its key or its model is wrong."""
    cut: bool = False
    """Whether its model reached its limit of tokens within the text."""
    rethink: int = Field(default=0, ge=0, le=MAX_RETHINKS)
    """How often the agent wants to reply again to one observation, if nothing of its reply is possible."""
    rethinks: int = Field(default=0, ge=0, le=MAX_RETHINKS)
    """Number of the verdict that it answers; 0 for a reply to the observation itself."""
    latency_s: float = 0.0
    """From the arrival of the observation to this reply."""
    attempts: Count = 0
    usage: Usage = Usage()
    """Of all requests since the observation first arrived."""
    pace: Pace | None = None
    """The pace of its model, if the model file gives one; see `Clock.pace`."""
    human: bool = Field(default=False, exclude_if=lambda human: not human)
    """Whether a person plays the agent; absent if not."""

    @model_validator(mode="before")
    @classmethod
    def _without_calls(cls, data: Any) -> Any:
        """Remove the calls that recordings of early versions hold next to the text."""
        return {k: v for k, v in data.items() if k != "calls"} if isinstance(data, dict) and "calls" in data else data


class Advice(Wire):
    """Adviser → host: a message to agents from outside the match, by a person or another program."""

    kind: Literal["advice"] = "advice"
    agent: str
    """The adviser."""
    side: str
    recipient: str
    """An agent, a channel, or `everyone` for all agents of the side."""
    text: str = Field(min_length=1, max_length=MAX_ADVICE_CHARACTERS)


class ChatMessage(Frozen):
    """One message of a prompt."""

    role: Literal["system", "user", "assistant"]
    content: str
    images: tuple[ImageRef, ...] = ()
    """Pictures before the text, in their order."""


class TokenTrace(Frozen):
    """The tokens of a request and its answer, as far as the endpoint told them; what it did not tell is empty."""

    prompt_ids: tuple[int, ...] = ()
    """Of the whole prompt, with what the chat template adds."""
    reply_ids: tuple[int, ...] = ()
    """Of all that the model generated, its reasoning as well."""
    logprobs: tuple[float, ...] = ()
    """Natural logarithm of the probability of each generated token; -9999 for 0, as vLLM has it."""


class ModelCall(Wire):
    """Agent → recorder: one request to a model and its answer. Never a key."""

    kind: Literal["exchange"] = "exchange"
    agent: str
    side: str
    episode: Count
    step: Count
    purpose: Purpose = "decision"
    attempt: int = Field(ge=1)
    """Number of the try, from 1, of this step and purpose."""
    model: str
    """As it was asked for."""
    answered_by: str = ""
    """As the endpoint called it in its answer, with its version; "" if it did not say."""
    endpoint: str
    """Base URL without credentials or query."""
    prompt: tuple[ChatMessage, ...]
    params: dict[str, str | int | float | bool | None] = {}
    completion: str | None
    """None if no answer came."""
    finish: str = ""
    """Why it ended, in the words of the endpoint: `stop`, `length`, …"""
    status: str
    """`ok`, `empty`, `cut`, `refused` or `filtered` of an answer; else `timeout`, `cancelled`, `http 429`,
    `connection`, `malformed`."""
    reason: str = ""
    """Why there is nothing to play, in the words of the endpoint; "" if there is."""
    started_s: float
    """Since the observation's arrival."""
    latency_s: float
    waited_s: float = 0.0
    """Time spent before the request in the queue of the shared limits."""
    left_out: tuple[str, ...] = ()
    """Parts of the prompt that were left out so that it fits the model's context."""
    room_tokens: int | None = None
    """Estimated tokens to which the prompt was fitted; None if it is whole."""
    usage: Usage = Usage()
    tokens: TokenTrace | None = Field(default=None, exclude_if=lambda tokens: tokens is None)
    """Absent if the endpoint told none of them; it tells them if `extra` of the model file asks for them."""
