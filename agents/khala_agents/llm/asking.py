"""What the clients of all kinds of endpoints share: one try over HTTP, without what an endpoint refuses by name.

Below it are `khala_agents.llm.http` and `khala_agents.llm.quirks`. Above it are `openai_compatible` and `anthropic`,
which make the body of a request and read that of an answer.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic_core import to_json

from khala_agents.llm.client import Completion, Request, Scalar, TryTimeout, estimated_tokens
from khala_agents.llm.faults import verdict_of
from khala_agents.llm.http import OK
from khala_agents.llm.quirks import LIMITS, REFUSALS, SystemRole, quirks_of
from khala_protocol.messages import MOST

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.llm.http import HttpAnswer, HttpEndpoint

_LONG_PROMPT = 2000
_FAR_FEWER = 0.5
"""Part of the estimated tokens of a long prompt below which an endpoint has hardly read all of it. The estimate is low:
tags and coordinates take more than a token for four characters."""


class HttpClient(ABC):
    """An `LLMClient` over HTTP.

    Args:
        http: the endpoint.
        model: as the endpoint calls it.
        fields: of each request's body, beside the model and the messages.
    """

    PATH: ClassVar[str]

    def __init__(self, http: HttpEndpoint, *, model: str, fields: Mapping[str, Any]) -> None:
        self.model = model
        self.endpoint = http.address
        self.quirks = quirks_of(http.address, model)
        limits = [value for name in LIMITS if isinstance(value := fields.get(name), int)]
        self.answer_tokens: int | None = max(limits, default=None)
        self.params: Mapping[str, Scalar] = {}
        self._http = http
        self._all_fields = dict(fields)
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
        completion = self._read(answer)
        self._remark(request, completion)
        return completion

    async def check(self) -> None:
        """Check that the endpoint accepts the key; see `LLMClient.check`."""
        await self._http.check()

    async def refresh(self) -> None:
        """Drop old connections and make a new one."""
        await self._http.refresh()

    async def close(self) -> None:
        """Close the connections."""
        await self._http.close()

    @abstractmethod
    def _body(self, request: Request) -> dict[str, Any]:
        """Return the body of a request, with `self._fields` in it."""

    @abstractmethod
    def _read(self, answer: HttpAnswer) -> Completion:
        """Return the completion in an answer, or raise an `LLMError`."""

    @property
    def _role(self) -> SystemRole | None:
        """The role of the system message, if it can change."""
        return None

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
