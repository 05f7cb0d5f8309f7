"""What the clients of all kinds of endpoints share: one try over HTTP, without what an endpoint refuses by name.

Below it are `khala_agents.llm.http` and `khala_agents.llm.quirks`. Above it are `openai_compatible` and `anthropic`:
each makes the body of a request, takes an answer apart, and counts its tokens.
"""

from __future__ import annotations

import asyncio
import contextlib
from abc import ABC, abstractmethod
from base64 import b64encode
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Required, TypedDict, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import from_json, to_json

from khala_agents.llm.client import Completion, Request, Scalar, TryTimeout, estimated_tokens, model_name
from khala_agents.llm.faults import no_completion, verdict_of, without_byte_order_mark
from khala_agents.llm.http import OK, HttpEndpoint
from khala_agents.llm.quirks import LIMITS, REFUSALS, SystemRole, quirks_of
from khala_agents.llm.verdict import AnswerParts, judge
from khala_protocol.messages import MOST

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import JsonValue, SecretStr

    from khala_agents.answers.form import AnswerShape
    from khala_agents.llm.http import HttpAnswer
    from khala_agents.llm.pricing import Prices
    from khala_protocol.messages import ChatMessage, Usage

_LONG_PROMPT = 2000
_FAR_FEWER = 0.5
"""Part of the estimated tokens of a long prompt below which an endpoint has hardly read all of it. The estimate is low:
tags and coordinates take more than a token for four characters."""


class ClientOptions(TypedDict, total=False):
    """Options that the clients of all kinds of endpoints have."""

    model: Required[str]
    """As the endpoint calls it."""
    base_url: Required[str]
    """Usually ends in `/v1`."""
    prices: Required[Prices]
    """To price the tokens with."""
    key: SecretStr | None
    """None for no key."""
    key_header: tuple[str, str]
    """Name and prefix of the header that carries the key; the API's own if it is left out."""
    headers: Mapping[str, str]
    """Sent with each request."""
    query: Mapping[str, str]
    """Sent with each request."""
    extra: Mapping[str, JsonValue]
    """Fields of the request body, unchanged."""


class AnswerBody(BaseModel):
    """The body of an answer. Of what is no text for us any form is taken: it must not cost us the text."""

    model: Any = None
    usage: Any = None


AnswerBodyT = TypeVar("AnswerBodyT", bound=AnswerBody)


class HttpClient(ABC, Generic[AnswerBodyT]):
    """An `LLMClient` over HTTP.

    Args:
        asked: fields of each request's body, beside the model and the messages; those with None are not sent.
        options: see `ClientOptions`.

    Attributes:
        PATH: of requests, after the base URL.
        ANSWER: the form of their answers.
        CALLED: what errors call an answer.
        KEY_HEADER: name and prefix of the header that carries the key.
        HEADERS: sent with each request, before those of the options.
    """

    PATH: ClassVar[str]
    ANSWER: type[AnswerBodyT]
    CALLED: ClassVar[str]
    KEY_HEADER: ClassVar[tuple[str, str]] = ("Authorization", "Bearer ")
    HEADERS: ClassVar[Mapping[str, str]] = {}

    def __init__(self, asked: Mapping[str, JsonValue], options: ClientOptions) -> None:
        http = HttpEndpoint(
            options["base_url"],
            headers={**self.HEADERS, **options.get("headers", {})},
            query=options.get("query"),
            key_header=options.get("key_header", self.KEY_HEADER),
            key=options.get("key"),
        )
        fields = {name: value for name, value in asked.items() if value is not None} | dict(options.get("extra", {}))
        limits = [value for name in LIMITS if isinstance(value := fields.get(name), int)]
        self.model = options["model"]
        self.endpoint = http.address
        self.quirks = quirks_of(http.address, self.model)
        self.answer_tokens: int | None = max(limits, default=None)
        self.params: Mapping[str, Scalar] = {}
        self._http = http
        self._prices = options["prices"]
        self._all_fields = fields
        self._fields = self._fit()

    async def complete(self, request: Request) -> Completion:
        """Make one try; see `LLMClient`."""
        try:
            async with asyncio.timeout(request.timeout_s):
                answer = await self._ask(request)
        except TimeoutError:
            raise TryTimeout(f"{self.endpoint} gave no answer within {request.timeout_s:g} s") from None
        withheld = verdict_of(answer.status, answer.body)
        if withheld is not None:
            verdict, reason = withheld
            return Completion("", finish=verdict, verdict=verdict, reason=reason)
        if answer.status != OK:
            raise answer.error
        completion = self._read(answer, tools_offered=bool(request.shape and request.shape.tools))
        self._remark(request, completion)
        return completion

    async def check(self) -> None:
        """Check that the endpoint accepts the key; see `LLMClient.check`."""
        await self._http.check()

    async def read(self, path: str) -> Any:
        """Return the JSON at an address of the endpoint, see `HttpEndpoint.read`; None if there is none."""
        body = await self._http.read(path)
        with contextlib.suppress(ValueError):
            return from_json(body or b"")
        return None

    async def refresh(self) -> None:
        """Drop old connections and make a new one."""
        await self._http.refresh()

    async def close(self) -> None:
        """Close the connections."""
        await self._http.close()

    @abstractmethod
    def _body(self, request: Request) -> dict[str, Any]:
        """Return the body of a request, with `self._fields_for` it."""

    @abstractmethod
    def _shape(self, shape: AnswerShape) -> dict[str, Any]:
        """Return the fields of a request that hold its answer to a form."""

    @abstractmethod
    def _take_apart(self, body: AnswerBodyT, url: str) -> AnswerParts:
        """Return an answer of the endpoint in common terms, or raise an `LLMError`; `url` is the address asked."""

    @abstractmethod
    def _usage(self, counts: object) -> Usage:
        """Return the tokens of an answer and their price from the endpoint's own counts."""

    @abstractmethod
    def _picture(self, media_type: str, data: str) -> dict[str, Any]:
        """Return a picture, in base64, as a part of a message."""

    @property
    def _role(self) -> SystemRole | None:
        """The role of the system message, if it can change."""
        return None

    def _fields_for(self, request: Request) -> dict[str, Any]:
        """Return the fields of a request beside its model and messages, without those that the endpoint refuses."""
        shape = self._shape(request.shape) if request.shape else {}
        return {**self.quirks.fit(shape), **self._fields}

    def _content(self, message: ChatMessage, pictures: Mapping[str, bytes]) -> str | list[dict[str, Any]]:
        """Return the content of a message: its text, behind its pictures if it has any, each under its title."""
        if not message.images:
            return message.content
        parts: list[dict[str, Any]] = []
        for image in message.images:
            parts.append({"type": "text", "text": image.title})
            parts.append(self._picture(image.media_type, b64encode(pictures[image.sha256]).decode()))
        return [*parts, {"type": "text", "text": message.content}]

    def _read(self, answer: HttpAnswer, *, tools_offered: bool) -> Completion:
        """Return the completion in an answer, or raise an `LLMError`."""
        try:
            body = self.ANSWER.model_validate_json(without_byte_order_mark(answer.body))
        except ValidationError:
            raise no_completion(answer.url, answer.body, self.CALLED) from None
        parts = self._take_apart(body, answer.url)
        judged = judge(parts, tools_offered=tools_offered)
        return Completion(
            text=judged.text,
            usage=self._usage(body.usage),
            finish=parts.finish,
            model=model_name(body.model),
            verdict=judged.verdict,
            reason=judged.reason,
        )

    async def _ask(self, request: Request) -> HttpAnswer:
        """Return the answer to a request; ask again where only a field was refused, which is done once for each."""
        while True:
            self._fields = self._fit()  # another client may have learned something
            body = self._body(request)
            role = self._role if any(message.role == "system" for message in request.messages) else None
            answer = await self._http.post(self.PATH, to_json(body), request.delivery)
            if answer.status not in REFUSALS or verdict_of(answer.status, answer.body):
                return answer
            learned = self.quirks.learn(answer.body, body, role)
            if not learned:
                return answer
            self.quirks.note_once(learned, f"{self.model} at {self.endpoint}: from now on Khala {learned}")

    def _fit(self) -> dict[str, Any]:
        fields = self.quirks.fit(self._all_fields)
        self.params = {name: value for name, value in fields.items() if not isinstance(value, dict | list)}
        return fields

    def _remark(self, request: Request, completion: Completion) -> None:
        """Say once what is odd about an answer that can be played."""
        where = f"{self.model} at {self.endpoint}"
        if completion.verdict == "ok" and completion.reason:
            self.quirks.note_once("reasoning", f"{where}: {completion.reason}")
        counted = completion.usage.prompt_tokens + completion.usage.cached_tokens  # some count cached tokens apart
        sent = estimated_tokens(request.messages)
        if completion.usage.prompt_tokens and sent > _LONG_PROMPT and counted < _FAR_FEWER * sent:
            self.quirks.note_once(
                "context",
                f"{where} counted {counted} tokens of a prompt of about {sent}: it has probably not read all of it, "
                "because its context is too small. Ollama: set OLLAMA_CONTEXT_LENGTH for the server, or num_ctx in a "
                "Modelfile; other servers have an option for it",
            )


def count(usage: object, *path: str) -> int | None:
    """Return a number of tokens from the usage of an answer; None if there is none that can be believed."""
    value: Any = usage
    for name in path:
        value = value.get(name) if isinstance(value, dict) else None
    if isinstance(value, str) and value.isdecimal() and len(value) <= len(str(MOST)):
        value = int(value)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return value if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST else None
