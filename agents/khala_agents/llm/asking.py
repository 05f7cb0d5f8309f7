"""What the clients of all kinds of endpoints share: one try over HTTP, without what an endpoint refuses by name.

Below it are `khala_agents.llm.http` and `khala_agents.llm.quirks`. Above it are `openai_compatible`, `responses`,
`anthropic` and `gemini`: each makes the body of a request, takes an answer apart, and counts its tokens.

Names of fields with dots are paths: `text.format` is sent as the field `format` of the object `text`.
"""

from __future__ import annotations

import asyncio
import contextlib
from abc import ABC, abstractmethod
from base64 import b64encode
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Required, TypedDict, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import from_json, to_json

from khala_agents.llm.batches import BatchApi, Batcher, batcher_for
from khala_agents.llm.client import Completion, Request, Scalar, TryTimeout, estimated_tokens, model_name
from khala_agents.llm.faults import no_completion, verdict_of, without_byte_order_mark
from khala_agents.llm.http import OK, HttpEndpoint
from khala_agents.llm.quirks import ALL_LIMITS, CACHE_MARK, REFUSALS, SentFields, SystemRole, quirks_of
from khala_agents.llm.schemas import without
from khala_agents.llm.verdict import AnswerParts, judge
from khala_protocol.messages import MOST

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pydantic import JsonValue, SecretStr

    from khala_agents.answers.form import AnswerShape
    from khala_agents.llm.client import Departure
    from khala_agents.llm.http import HttpAnswer
    from khala_agents.llm.pricing import Prices
    from khala_protocol.messages import ChatMessage, TokenTrace, Usage

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
    system_role: SystemRole | None
    """Of the system message; None: as the API has it."""
    batch: bool
    """Whether requests wait for a batch (`khala_agents.llm.batches`)."""


class AnswerBody(BaseModel):
    """The body of an answer. Of what is no text for us any form is taken: it must not cost us the text."""

    model: Any = None
    usage: Any = None


AnswerBodyT = TypeVar("AnswerBodyT", bound=AnswerBody)


class HttpClient(ABC, Generic[AnswerBodyT]):
    """An `LLMClient` over HTTP.

    Args:
        asked: fields of each request's body, beside the model and the messages, by name or path; those with None are
            not sent.
        options: see `ClientOptions`.

    Attributes:
        PATH: of requests, after the base URL; with `{model}` for its name.
        ANSWER: the form of their answers.
        CALLED: what errors call an answer.
        KEY_HEADER: name and prefix of the header that carries the key.
        HEADERS: sent with each request, before those of the options.
        BATCHES: the batches of the API; None if it has none.
        MARKS_CACHE: whether requests mark the messages that a cache should keep.
    """

    PATH: ClassVar[str]
    ANSWER: type[AnswerBodyT]
    CALLED: ClassVar[str]
    KEY_HEADER: ClassVar[tuple[str, str]] = ("Authorization", "Bearer ")
    HEADERS: ClassVar[Mapping[str, str]] = {}
    MARKS_CACHE: ClassVar[bool] = False
    BATCHES: ClassVar[type[BatchApi] | None] = None

    def __init__(self, asked: Mapping[str, Any], options: ClientOptions) -> None:
        self._connect = partial(
            HttpEndpoint,
            options["base_url"],
            headers={**self.HEADERS, **options.get("headers", {})},
            query=options.get("query"),
            key_header=options.get("key_header", self.KEY_HEADER),
            key=options.get("key"),
        )
        http = self._connect()
        fields = {name: value for name, value in asked.items() if value is not None} | dict(options.get("extra", {}))
        limits = [value for name in ALL_LIMITS if isinstance(value := fields.get(name), int)]
        self.model = options["model"]
        self.endpoint = http.address
        self.quirks = quirks_of(http.address, self.model)
        self.answer_tokens: int | None = max(limits, default=None)
        self.params: Mapping[str, Scalar] = {}
        self._system_role = options.get("system_role")
        self._path = self.PATH.format(model=self.model.removeprefix("models/"))
        self._account = (self.endpoint, self.PATH, self.model, options.get("key"))
        self._in_batches = options.get("batch", False)
        self._batcher: Batcher | None = None
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
        """Close the connections; cancel a batch in which nothing else waits."""
        if self._batcher is not None:
            await self._batcher.settle()
        await self._http.close()

    @abstractmethod
    def _body(self, request: Request) -> dict[str, Any]:
        """Return the body of a request, with `self._fields_for` it."""

    @abstractmethod
    def _shape(self, shape: AnswerShape) -> dict[str, Any]:
        """Return the fields of a request that hold its answer to a form, by names that may be paths."""

    @abstractmethod
    def _take_apart(self, body: AnswerBodyT, url: str) -> AnswerParts:
        """Return an answer of the endpoint in common terms, or raise an `LLMError`; `url` is the address asked."""

    @abstractmethod
    def _usage(self, counts: object) -> Usage:
        """Return the tokens of an answer and their price from the endpoint's own counts."""

    def _tokens(self, body: AnswerBodyT) -> TokenTrace | None:  # noqa: ARG002  # most endpoints tell none
        """Return the tokens of a prompt and its answer; None if the endpoint did not tell any."""
        return None

    @abstractmethod
    def _picture(self, media_type: str, data: str) -> dict[str, Any]:
        """Return a picture, in base64, as a part of a message."""

    @property
    def _role(self) -> SystemRole | None:
        """The role of the system message, if it can change."""
        return self._system_role and (self.quirks.system_role or self._system_role)

    def _prompt(self, request: Request) -> Sequence[ChatMessage]:
        """Return the messages to send."""
        return _fold(request.messages) if self._role == "fold" else request.messages

    def _fields_for(self, request: Request) -> dict[str, Any]:
        """Return the fields of a request beside its model and messages, as its body has them."""
        return nest({**self.quirks.fit(self._shape_for(request)), **self._fields})

    def _shape_for(self, request: Request) -> dict[str, Any]:
        """Return the fields that hold the answer to its form, without what the endpoint refuses of schemas."""
        shape = request.shape
        if shape is None:
            return {}
        refused = self.quirks.keywords
        if refused:
            tools = (replace(tool, parameters=without(tool.parameters, refused)) for tool in shape.tools)
            shape = replace(shape, schema=without(shape.schema, refused), tools=tuple(tools))
        return self._shape(shape)

    def _words(self, text: str) -> dict[str, Any]:
        """Return a text as a part of a message."""
        return {"type": "text", "text": text}

    def _parts(self, message: ChatMessage, pictures: Mapping[str, bytes]) -> list[dict[str, Any]]:
        """Return the parts of a message: its text behind its pictures, each under its title."""
        parts: list[dict[str, Any]] = []
        for image in message.images:
            parts.append(self._words(image.title))
            parts.append(self._picture(image.media_type, b64encode(pictures[image.sha256]).decode()))
        return [*parts, self._words(message.content)]

    def _content(self, message: ChatMessage, pictures: Mapping[str, bytes]) -> str | list[dict[str, Any]]:
        """Return the content of a message: its text, or its parts if it has pictures."""
        return self._parts(message, pictures) if message.images else message.content

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
            tokens=self._tokens(body),
        )

    async def _ask(self, request: Request) -> HttpAnswer:
        """Return the answer to a request; ask again where only a field was refused, which is done once for each."""
        while True:
            self._fields = self._fit()  # another client may have learned something
            body = self._body(request)
            sent = self._sent(request)
            role = self._role if any(message.role == "system" for message in request.messages) else None
            answer = await self._post(to_json(body), request.delivery)
            if answer.status not in REFUSALS or verdict_of(answer.status, answer.body):
                return answer
            learned = self.quirks.learn(answer.body, sent, role)
            if not learned:
                return answer
            self.quirks.note_once(learned, f"{self.model} at {self.endpoint}: from now on Khala {learned}")

    async def _post(self, body: bytes, delivery: Departure) -> HttpAnswer:
        api = self.BATCHES
        if api is None or not self._in_batches:
            return await self._http.post(self._path, body, delivery)
        self._batcher = batcher_for(self._account, lambda: Batcher(api(self._connect(), self._path)))
        return await self._batcher.post(body, delivery)

    def _sent(self, request: Request) -> SentFields:
        """Return what an endpoint may refuse of a request."""
        marks = {CACHE_MARK: None} if self.MARKS_CACHE and request.stable else {}
        form = self.quirks.fit(self._shape_for(request))
        return SentFields(form, {**self._fields, **self.quirks.fit(marks)})

    def _fit(self) -> dict[str, Any]:
        fields = self.quirks.fit(self._all_fields)
        self.params = parameters_of(fields)
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


def nest(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return a body with these fields, whose names may be paths."""
    body: dict[str, Any] = {}
    for path, value in fields.items():
        *outer, name = path.split(".")
        place = body
        for part in outer:
            place = place.setdefault(part, {})
        known = place.get(name)
        place[name] = {**known, **value} if isinstance(known, dict) and isinstance(value, dict) else value
    return body


def parameters_of(fields: Mapping[str, Any], outer: str = "") -> dict[str, Scalar]:
    """Return fields as a recording shows them: by path, lists as text."""
    shown: dict[str, Scalar] = {}
    for name, value in fields.items():
        if isinstance(value, dict):
            shown |= parameters_of(value, f"{outer}{name}.")
        else:
            shown[f"{outer}{name}"] = to_json(value).decode() if isinstance(value, list | tuple) else value
    return shown


def _fold(messages: Sequence[ChatMessage]) -> Sequence[ChatMessage]:
    """Return messages with the system message in front of the first one of the user."""
    if not messages or messages[0].role != "system":
        return messages
    system, *others = messages
    place = next((place for place, message in enumerate(others) if message.role == "user"), None)
    if place is None:
        return [system.model_copy(update={"role": "user"}), *others]
    first = others[place]
    others[place] = first.model_copy(update={"content": f"{system.content}\n\n{first.content}"})
    return others


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
