"""OpenAI's chat completions, as spoken by nearly every endpoint, including Khala's own scripted one.

A row of `khala_agents.llm.profiles` says how an endpoint differs.
"""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, Field, ValidationError
from pydantic_core import to_json

from khala_agents.llm.client import Completion, LLMError, MalformedCompletion, Request, Scalar, model_name
from khala_agents.llm.http import HttpEndpoint, error_for
from khala_agents.secret import excerpt, scrub
from khala_protocol.messages import MOST, Usage

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import JsonValue, SecretStr

    from khala_agents.llm.pricing import Prices
    from khala_agents.llm.profiles import Profile
    from khala_agents.llm.vision import Detail
    from khala_protocol.messages import ChatMessage

_PATH = "/chat/completions"


class OpenAICompatible:
    """An `LLMClient` for one model at one endpoint.

    Args:
        profile: the particulars of the endpoint.
        model: as the endpoint calls it.
        base_url: usually ends in `/v1`.
        prices: to price the tokens with.
        key: None for no key.
        max_tokens: limit of generated tokens.
        temperature, seed: sent if given and if the endpoint accepts them.
        extra: fields of the request body, unchanged.
        detail: how finely the model looks at pictures.
    """

    def __init__(
        self,
        profile: Profile,
        *,
        model: str,
        base_url: str,
        prices: Prices,
        key: SecretStr | None = None,
        max_tokens: int | None = None,
        temperature: float | None = None,
        seed: int | None = None,
        extra: Mapping[str, JsonValue] | None = None,
        detail: Detail = "auto",
    ) -> None:
        asked = {
            profile.length_field: max_tokens,
            "temperature": temperature if profile.temperature else None,
            "seed": seed if profile.seed else None,
        }
        fields: dict[str, JsonValue] = {name: value for name, value in asked.items() if value is not None}
        fields.update(extra or {})
        self.model = model
        self.answer_tokens = max_tokens
        self.params: Mapping[str, Scalar] = {k: v for k, v in fields.items() if not isinstance(v, dict | list)}
        self._http = HttpEndpoint(base_url, key=key)
        self.endpoint = self._http.address
        self._profile = profile
        self._prices = prices
        self._detail = detail
        self._fixed = {"model": model, **fields}

    async def complete(self, request: Request) -> Completion:
        """Make one try; see `LLMClient`."""
        messages = [self._message(message, request.pictures) for message in request.messages]
        body = to_json({**self._fixed, "messages": messages})
        answer = await self._http.post(_PATH, body, request.timeout_s)
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

    def _message(self, message: ChatMessage, pictures: Mapping[str, bytes]) -> dict[str, Any]:
        role = self._profile.system_role if message.role == "system" else message.role
        if not message.images:
            return {"role": role, "content": message.content}
        parts: list[dict[str, Any]] = []
        for image in message.images:
            url = f"data:{image.media_type};base64,{b64encode(pictures[image.sha256]).decode()}"
            parts.append({"type": "text", "text": image.title})
            parts.append({"type": "image_url", "image_url": {"url": url, "detail": self._detail}})
        return {"role": role, "content": [*parts, {"type": "text", "text": message.content}]}

    def _read(self, answer: bytes) -> Completion:
        try:
            body = _Body.model_validate_json(answer)
        except ValidationError:
            raise self._no_completion(answer) from None
        choice = body.choices[0]
        return Completion(
            text=scrub(choice.message.words()),
            usage=self._usage(body.usage),
            finish=choice.finish_reason or "stop",
            model=model_name(body.model),
        )

    def _no_completion(self, answer: bytes) -> LLMError:
        try:
            fault = _Fault.model_validate_json(answer)  # "200 OK" with the error in the body: OpenRouter does it
        except ValidationError:
            begin = excerpt(answer, 80)
            return MalformedCompletion(f"{self.endpoint} answered with no chat completion: {begin!r}")
        return error_for(self.endpoint, fault.error.code, {}, answer)

    def _usage(self, said: dict[str, Any] | None) -> Usage:
        prompt, completion = _count(said, "prompt_tokens"), _count(said, "completion_tokens")
        if prompt is None or completion is None:
            return Usage(requests=1, unknown_requests=1)
        cached = min(_count(said, *self._profile.cached_path) or 0, prompt)
        return Usage(
            requests=1,
            prompt_tokens=prompt,
            completion_tokens=completion,
            cached_tokens=cached,
            reasoning_tokens=_count(said, *self._profile.reasoning_path) or 0,
            cost_usd=self._prices.cost_usd(prompt=prompt, completion=completion, cached=cached),
        )


class _Part(BaseModel):
    type: str = "text"
    text: str = ""


class _Message(BaseModel):
    content: str | list[_Part] | None = None
    refusal: str | None = None

    def words(self) -> str:
        if isinstance(self.content, list):
            return "".join(part.text for part in self.content if part.type == "text")
        return self.content or self.refusal or ""


class _Choice(BaseModel):
    message: _Message
    finish_reason: str | None = None


class _Body(BaseModel):
    model: Any = None
    choices: Annotated[list[_Choice], Field(min_length=1)]
    usage: dict[str, Any] | None = None


class _FaultDetail(BaseModel):
    code: Annotated[int, Field(ge=400, le=599)]


class _Fault(BaseModel):
    error: _FaultDetail


def _count(usage: dict[str, Any] | None, *path: str) -> int | None:
    value: Any = usage
    for name in path:
        value = value.get(name) if isinstance(value, dict) else None
    return value if isinstance(value, int) and 0 <= value <= MOST else None
