"""One request to a language model and its possible outcomes: the interface that every client implements.

A client makes one try and no more: `khala_agents.llm.retry` repeats, `khala_agents.llm.limits` holds back, and
`khala_agents.llm_policy.LLMPolicy` joins the three. The type of an error says whose fault it is:

    LLMError                    .status as recorded in a `ModelCall`, .retryable
    ├── RequestRefused          ours: the request is wrong, and stays wrong (400, 404, 413, 422, …)
    │   └── Unauthorized        the user's: the key (401, 403)
    ├── OutOfMoney              the account is empty or its quota used up (402, some 429)
    ├── EndpointUnavailable     the provider's, for now (408, 409, 429, 5xx); may say when to come back
    ├── EndpointAway            it failed so often that it is not asked now (`khala_agents.llm.breaker`)
    ├── NotRecorded             a recording that answers has no such request (`khala_agents.llm.replay`)
    ├── Unreachable             the link's: refused, reset, broken in the middle
    ├── TryTimeout              the time of this one try is over
    ├── MalformedCompletion     the provider's: "200 OK" without a completion in it
    └── LimitExceeded           ours: a limit that the user has set

No error text holds a key: texts of a server pass through `khala_agents.secret.excerpt`.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol, TypeAlias

from khala_agents.llm.verdict import CUT
from khala_protocol.errors import KhalaError
from khala_protocol.messages import ChatMessage, Usage

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from khala_agents.answers.form import AnswerShape
    from khala_agents.llm.verdict import Verdict
    from khala_agents.llm.vision import Vision
    from khala_protocol.messages import Purpose, TokenTrace

Scalar = str | int | float | bool | None

LimitType: TypeAlias = Literal["requests_per_minute", "tokens_per_minute", "budget_usd"]

UNBILLED = frozenset({"http 409", "http 429", "http 529"})
"""Statuses of an endpoint that turned a request away before a model read it. Any other 5xx may come from a gateway, and
the model behind it goes on writing."""

LONGEST_NAME = 100
"""Characters that are kept of the name by which an endpoint calls its model."""


@dataclass(frozen=True, slots=True)
class Origin:
    """The decision that a request belongs to; recordings are looked up by it."""

    agent: str
    episode: int
    step: int
    purpose: Purpose = "decision"


@dataclass(slots=True)
class Departure:
    """How far a request came: one that never left costs nothing.

    Attributes:
        left: whether a byte of it may have reached the endpoint; a client that can tell sets it to False until then.
    """

    left: bool = True

    EXTENSION: ClassVar[str] = "khala_delivery"
    """Under this name a request over HTTP carries it to its transport."""


@dataclass(frozen=True, slots=True)
class Request:
    """One request.

    Attributes:
        messages: the prompt, in order; only the first message may be a system message.
        timeout_s: time this try may take, from the start of sending to the last byte of the answer.
        origin: the decision it belongs to, if any.
        attempt: number of this try for this decision, from 1.
        pictures: bytes of all images that the messages name, by their hashes.
        stable: number of messages at the front that other requests of the episode begin with, too, for caches.
        shape: the form that the endpoint must hold the answer to; None for free text.
        delivery: how far it came.
    """

    messages: tuple[ChatMessage, ...]
    timeout_s: float | None = None
    origin: Origin | None = None
    attempt: int = 1
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    stable: int = 0
    shape: AnswerShape | None = None
    delivery: Departure = field(default_factory=Departure)


@dataclass(frozen=True, slots=True)
class Completion:
    """The answer of a model.

    Attributes:
        text: its words, without its reasoning.
        usage: tokens and price; `unknown_requests=1` if the endpoint did not say.
        finish: why it stopped, in the endpoint's words: `stop`, `length`, …
        model: which model answered, in the endpoint's words; "" if it did not say.
        verdict: whether it has words to play.
        reason: why it has none, in one line for people; "" if it has.
        tokens: those of the prompt and the answer, if the endpoint told them.
    """

    text: str
    usage: Usage = field(default_factory=lambda: Usage(requests=1, unknown_requests=1))
    finish: str = "stop"
    model: str = ""
    verdict: Verdict = "ok"
    reason: str = ""
    tokens: TokenTrace | None = None

    @property
    def cut(self) -> bool:
        """Whether it ended at a limit of tokens."""
        return self.finish.lower() in CUT


def model_name(said: object) -> str:
    """Return what an endpoint calls its model, cut to a name's length; "" for anything but text."""
    return said[:LONGEST_NAME] if isinstance(said, str) else ""


class LLMClient(Protocol):
    """A model at an endpoint. Safe to cancel at any moment; not safe for use by several agents at once.

    Attributes:
        model: its name, as the endpoint calls it.
        endpoint: base URL without credentials or query.
        params: other parameters of the request, as recorded.
        answer_tokens: the limit of generated tokens that the next request carries; None for no limit.
    """

    model: str
    endpoint: str
    params: Mapping[str, Scalar]
    answer_tokens: int | None

    async def complete(self, request: Request) -> Completion:
        """Make one try.

        Raises:
            LLMError: there is no completion; the type says why.
        """
        ...

    async def check(self) -> None:
        """Find out, without cost, what is wrong before the first request.

        Raises:
            Unauthorized: the endpoint refuses the key.
        """
        ...

    async def refresh(self) -> None:
        """Drop old connections and make a new one, between episodes. Raise nothing."""
        ...

    async def close(self) -> None:
        """Close the connections. May be called twice."""
        ...


class LLMError(KhalaError):
    """There is no completion.

    Attributes:
        status: as in `ModelCall.status`: `http 429`, `timeout`, `connection`, …
        retryable: whether the same request may succeed a little later.
        may_be_billed: whether an answer may have been generated; False if it is known that none was.
        hopeless: whether no request of this agent will ever succeed; `khala_agents.llm_policy` knows.
    """

    retryable: bool = False
    may_be_billed: bool = True
    hopeless: bool = False

    def __init__(self, message: str, *, status: str) -> None:
        self.status = status
        super().__init__(message)


class RequestRefused(LLMError):
    """The endpoint will never accept this request."""

    may_be_billed = False


class Unauthorized(RequestRefused):
    """The endpoint does not accept the key."""


class OutOfMoney(LLMError):
    """The account at the endpoint has no money or no quota left."""

    may_be_billed = False


class EndpointUnavailable(LLMError):
    """The endpoint cannot answer now.

    Attributes:
        retry_after_s: the earliest time for the next try, if it said so.
    """

    retryable = True

    def __init__(self, message: str, *, status: str, retry_after_s: float | None = None) -> None:
        self.retry_after_s = retry_after_s
        self.may_be_billed = status not in UNBILLED
        super().__init__(message, status=status)


class Unreachable(LLMError):
    """There is no connection, or it broke before the answer was complete.

    Args:
        message: what happened.
        sent: whether the request may have arrived, and an answer may have been generated.
    """

    retryable = True

    def __init__(self, message: str, *, sent: bool = True) -> None:
        self.may_be_billed = sent
        super().__init__(message, status="connection")


class TryTimeout(LLMError):
    """The try took too long."""

    retryable = True

    def __init__(self, message: str) -> None:
        super().__init__(message, status="timeout")


class LimitExceeded(LLMError):
    """A request would exceed a limit that the user has set.

    Attributes:
        type: which limit.
        value: its value with this request.
        limit: its maximum.
        source: where it was set.
    """

    may_be_billed = False

    def __init__(self, kind: LimitType, *, value: float, limit: float, source: str, words: str = "") -> None:
        self.type, self.value, self.limit, self.source = kind, value, limit, source
        text = words or f"the limit {kind} = {limit:g} of {source} is reached ({value:.4g})"
        super().__init__(text, status="budget" if kind == "budget_usd" else "limit")


class MalformedCompletion(LLMError):
    """The endpoint's answer is not a completion."""

    retryable = True

    def __init__(self, message: str) -> None:
        super().__init__(message, status="malformed")


def prompt_sha256(messages: Iterable[ChatMessage]) -> str:
    """Return the hash of a prompt: of roles, contents and hashes of pictures, with their boundaries."""
    digest = hashlib.sha256()
    for message in messages:
        content = message.content.encode("utf-8", "surrogatepass")
        digest.update(f"{message.role} {len(content)}\n".encode())
        digest.update(content)
        for image in message.images:
            digest.update(f"\n{image.sha256} {image.title}\n".encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


def estimated_tokens(messages: Sequence[ChatMessage], vision: Vision | None = None) -> int:
    """Return the tokens of a prompt: texts at about four bytes a token, pictures by the model's rule."""
    texts = (text for message in messages for text in (message.content, *(image.title for image in message.images)))
    return sum(map(estimated_text_tokens, texts)) + (estimated_image_tokens(messages, vision) if vision else 0)


def estimated_text_tokens(text: str) -> int:
    """Return the tokens of a text at about four bytes a token."""
    return -(-_bytes(text) // 4)


def estimated_image_tokens(messages: Iterable[ChatMessage], vision: Vision) -> int:
    """Return the tokens of the pictures of a prompt."""
    return sum(vision.image_tokens(image) for message in messages for image in message.images)


def _bytes(text: str) -> int:
    return len(text) if text.isascii() else len(text.encode("utf-8", "surrogatepass"))
