"""Anthropic's messages API, natively: their OpenAI-compatible layer is meant for tests and ignores parameters."""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from khala_agents.llm.asking import HttpClient, count
from khala_agents.llm.client import Completion, Request, model_name
from khala_agents.llm.faults import no_completion, unpacked
from khala_agents.llm.http import HttpEndpoint
from khala_agents.llm.quirks import CACHE_MARK
from khala_agents.llm.verdict import AnswerParts, judge
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import JsonValue, SecretStr

    from khala_agents.llm.http import HttpAnswer
    from khala_agents.llm.pricing import Prices
    from khala_protocol.messages import ChatMessage

API_VERSION = "2023-06-01"
DEFAULT_BASE_URL = "https://api.anthropic.com/v1"


class Anthropic(HttpClient):
    """An `LLMClient` for one Claude model.

    Args:
        model: `claude-…`.
        prices: to price the tokens with.
        key: of the account.
        key_header: name and prefix of the header that carries the key.
        headers, query: sent with each request.
        base_url: set it for a gateway; Anthropic's own by default.
        max_tokens: limit of generated tokens; the API requires one.
        temperature: sent if given.
        extra: fields of the request body, unchanged.
    """

    PATH = "/messages"

    def __init__(
        self,
        *,
        model: str,
        prices: Prices,
        key: SecretStr | None,
        key_header: tuple[str, str] = ("x-api-key", ""),
        headers: Mapping[str, str] | None = None,
        query: Mapping[str, str] | None = None,
        base_url: str = DEFAULT_BASE_URL,
        max_tokens: int = 1024,
        temperature: float | None = None,
        extra: Mapping[str, JsonValue] | None = None,
    ) -> None:
        asked: dict[str, JsonValue] = {"max_tokens": max_tokens}
        if temperature is not None:
            asked["temperature"] = temperature
        asked.update(extra or {})
        sent = {"anthropic-version": API_VERSION, **(headers or {})}
        http = HttpEndpoint(base_url, headers=sent, query=query, key_header=key_header, key=key)
        super().__init__(http, model=model, fields=asked)
        self._prices = prices

    def _body(self, request: Request) -> dict[str, Any]:
        system = "\n\n".join(m.content for m in request.messages if m.role == "system")
        marks = request.stable if CACHE_MARK not in self.quirks.left_out else 0
        turns = [
            _cached(message.content, role=message.role) if place == marks - 1 else _turn(message, request.pictures)
            for place, message in enumerate(request.messages)
            if message.role != "system"
        ]
        body: dict[str, Any] = {"model": self.model, **self._fields, "messages": turns}
        if system:
            body["system"] = _cached(system)["content"] if marks else system
        return body

    def _read(self, answer: HttpAnswer) -> Completion:
        try:
            body = _Body.model_validate_json(unpacked(answer.body))
        except ValidationError:
            raise no_completion(answer.url, answer.body, "message") from None
        finish = body.stop_reason if isinstance(body.stop_reason, str) else "end_turn"
        blocks = [block for block in body.content if isinstance(block, dict)]
        said = AnswerParts(
            text="".join(_text(block) for block in blocks if block.get("type") == "text"),
            finish=finish,
            reasoned=any(block.get("type") in {"thinking", "redacted_thinking"} for block in blocks),
            tools=tuple(str(block.get("name", "")) for block in blocks if block.get("type") == "tool_use"),
            limit=self.answer_tokens,
        )
        judged = judge(said)
        return Completion(
            text=judged.text,
            usage=_usage(body.usage, self._prices),
            finish=finish,
            model=model_name(body.model),
            verdict=judged.verdict,
            reason=judged.reason,
        )


def _cached(text: str, role: str = "") -> dict[str, Any]:
    """Return a message up to whose end a prompt is cached: the same in all requests of an episode."""
    block = {"type": "text", "text": text, CACHE_MARK: {"type": "ephemeral"}}
    return {"role": role, "content": [block]}


def _turn(message: ChatMessage, pictures: Mapping[str, bytes]) -> dict[str, Any]:
    if not message.images:
        return {"role": message.role, "content": message.content}
    blocks: list[dict[str, Any]] = []
    for image in message.images:
        data = b64encode(pictures[image.sha256]).decode()
        blocks.append({"type": "text", "text": image.title})
        blocks.append({"type": "image", "source": {"type": "base64", "media_type": image.media_type, "data": data}})
    return {"role": message.role, "content": [*blocks, {"type": "text", "text": message.content}]}


def _text(block: Mapping[str, Any]) -> str:
    text = block.get("text")
    return text if isinstance(text, str) else ""


def _usage(said: object, prices: Prices) -> Usage:
    """Return the usage in our terms: Anthropic counts cached tokens separately from `input_tokens`."""
    read, written = count(said, "input_tokens"), count(said, "output_tokens")
    cached = count(said, "cache_read_input_tokens") or 0
    kept = count(said, "cache_creation_input_tokens") or 0
    prompt = (read or 0) + cached + kept
    if read is None or not prompt or not written:  # of a prompt and an answer that were read, none has 0 tokens
        return Usage(requests=1, unknown_requests=1)
    return Usage(
        requests=1,
        prompt_tokens=prompt,
        completion_tokens=written,
        cached_tokens=cached,
        cache_write_tokens=kept,
        cost_usd=prices.cost_usd(prompt=prompt, completion=written, cached=cached, cache_write=kept),
    )


class _Body(BaseModel):
    """An answer. Of what is no text for us any form is taken: it must not cost us the text."""

    model: Any = None
    content: list[Any]
    stop_reason: Any = None
    usage: Any = None
