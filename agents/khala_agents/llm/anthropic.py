"""Anthropic's messages API, natively: their OpenAI-compatible layer is meant for tests and ignores parameters."""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, Field, ValidationError
from pydantic_core import to_json

from khala_agents.llm.client import Completion, MalformedCompletion, Request, Scalar, model_name
from khala_agents.llm.http import HttpEndpoint
from khala_agents.secret import excerpt, scrub
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import JsonValue, SecretStr

    from khala_agents.llm.pricing import Prices
    from khala_protocol.messages import ChatMessage

API_VERSION = "2023-06-01"
DEFAULT_BASE_URL = "https://api.anthropic.com/v1"


class Anthropic:
    """An `LLMClient` for one Claude model.

    Args:
        model: `claude-…`.
        prices: to price the tokens with.
        key: of the account.
        base_url: set it for a gateway; Anthropic's own by default.
        max_tokens: limit of generated tokens; the API requires one.
        temperature: sent if given.
        extra: fields of the request body, unchanged.
    """

    def __init__(
        self,
        *,
        model: str,
        prices: Prices,
        key: SecretStr | None,
        base_url: str = DEFAULT_BASE_URL,
        max_tokens: int = 1024,
        temperature: float | None = None,
        extra: Mapping[str, JsonValue] | None = None,
    ) -> None:
        asked: dict[str, JsonValue] = {"max_tokens": max_tokens}
        if temperature is not None:
            asked["temperature"] = temperature
        asked.update(extra or {})
        self.model = model
        self.answer_tokens: int | None = max_tokens
        self.params: Mapping[str, Scalar] = {k: v for k, v in asked.items() if not isinstance(v, dict | list)}
        self._http = HttpEndpoint(
            base_url, headers={"anthropic-version": API_VERSION}, key_header=("x-api-key", ""), key=key
        )
        self.endpoint = self._http.address
        self._prices = prices
        self._fixed = {"model": model, **asked}

    async def complete(self, request: Request) -> Completion:
        """Make one try; see `LLMClient`."""
        system = "\n\n".join(m.content for m in request.messages if m.role == "system")
        last = request.stable - 1
        turns = [
            _cached(message.content, role=message.role) if place == last else _turn(message, request.pictures)
            for place, message in enumerate(request.messages)
            if message.role != "system"
        ]
        body: dict[str, Any] = {**self._fixed, "messages": turns}
        if system:
            body["system"] = _cached(system)["content"] if request.stable else system
        answer = await self._http.post("/messages", to_json(body), request.timeout_s)
        return self._read(answer)

    async def check(self) -> None:
        """Check that the endpoint accepts the key; see `LLMClient.check`."""
        await self._http.check()

    async def refresh(self) -> None:
        """Drop old connections and make a new one."""
        await self._http.refresh()

    async def close(self) -> None:
        """Close the connections."""
        await self._http.close()

    def _read(self, answer: bytes) -> Completion:
        try:
            body = _Body.model_validate_json(answer)
        except ValidationError:
            begin = excerpt(answer, 80)
            raise MalformedCompletion(f"{self.endpoint} answered with no message: {begin!r}") from None
        return Completion(
            text=scrub("".join(block.text for block in body.content if block.type == "text")),
            usage=body.usage.priced(self._prices) if body.usage else Usage(requests=1, unknown_requests=1),
            finish=body.stop_reason or "end_turn",
            model=model_name(body.model),
        )


def _cached(text: str, role: str = "") -> dict[str, Any]:
    """Return a message up to whose end a prompt is cached: the same in all requests of an episode."""
    block = {"type": "text", "text": text, "cache_control": {"type": "ephemeral"}}
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


class _Block(BaseModel):
    type: str
    text: str = ""


class _Usage(BaseModel):
    input_tokens: int = Field(ge=0, le=10**12)
    output_tokens: int = Field(ge=0, le=10**12)
    cache_read_input_tokens: int | None = Field(default=None, ge=0, le=10**12)
    cache_creation_input_tokens: int | None = Field(default=None, ge=0, le=10**12)

    def priced(self, prices: Prices) -> Usage:
        """Return the usage in our terms: Anthropic counts cached tokens separately from `input_tokens`."""
        cached, kept = self.cache_read_input_tokens or 0, self.cache_creation_input_tokens or 0
        prompt = self.input_tokens + cached + kept
        return Usage(
            requests=1,
            prompt_tokens=prompt,
            completion_tokens=self.output_tokens,
            cached_tokens=cached,
            cache_write_tokens=kept,
            cost_usd=prices.cost_usd(prompt=prompt, completion=self.output_tokens, cached=cached, cache_write=kept),
        )


class _Body(BaseModel):
    model: Any = None
    content: list[_Block]
    stop_reason: str | None = None
    usage: _Usage | None = None
