"""OpenAI's chat completions, as spoken by nearly every endpoint, including Khala's own scripted one.

A row of `khala_agents.llm.profiles` says how an endpoint differs.
"""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, Field, ValidationError

from khala_agents.llm.asking import HttpClient, count
from khala_agents.llm.client import Completion, MalformedCompletion, Request, model_name
from khala_agents.llm.faults import broken_off, is_error, no_completion, unpacked
from khala_agents.llm.http import HttpEndpoint
from khala_agents.llm.verdict import CUT, FILTERED, AnswerParts, judge
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pydantic import JsonValue, SecretStr

    from khala_agents.llm.http import HttpAnswer
    from khala_agents.llm.pricing import Prices
    from khala_agents.llm.profiles import Profile
    from khala_agents.llm.quirks import SystemRole
    from khala_agents.llm.vision import Detail
    from khala_protocol.messages import ChatMessage


class OpenAICompatible(HttpClient):
    """An `LLMClient` for one model at one endpoint.

    Args:
        profile: the particulars of the endpoint.
        model: as the endpoint calls it.
        base_url: usually ends in `/v1`.
        prices: to price the tokens with.
        key: None for no key.
        key_header: name and prefix of the header that carries the key.
        headers, query: sent with each request.
        max_tokens: limit of generated tokens.
        temperature, seed: sent if given and if the endpoint accepts them.
        system_role: of the system message; None: as the profile says.
        extra: fields of the request body, unchanged.
        detail: how finely the model looks at pictures.
    """

    PATH = "/chat/completions"

    def __init__(
        self,
        profile: Profile,
        *,
        model: str,
        base_url: str,
        prices: Prices,
        key: SecretStr | None = None,
        key_header: tuple[str, str] = ("Authorization", "Bearer "),
        headers: Mapping[str, str] | None = None,
        query: Mapping[str, str] | None = None,
        max_tokens: int | None = None,
        temperature: float | None = None,
        seed: int | None = None,
        system_role: SystemRole | None = None,
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
        http = HttpEndpoint(base_url, key=key, key_header=key_header, headers=headers, query=query)
        super().__init__(http, model=model, fields=fields)
        self._profile = profile
        self._system_role: SystemRole = system_role or profile.system_role
        self._prices = prices
        self._detail = detail

    @property
    def _role(self) -> SystemRole:
        return self.quirks.system_role or self._system_role

    def _body(self, request: Request) -> dict[str, Any]:
        said = _folded(request.messages) if self._role == "fold" else request.messages
        messages = [self._message(message, request.pictures) for message in said]
        return {"model": self.model, **self._fields, "messages": messages}

    def _message(self, message: ChatMessage, pictures: Mapping[str, bytes]) -> dict[str, Any]:
        role = self._role if message.role == "system" else message.role
        if not message.images:
            return {"role": role, "content": message.content}
        parts: list[dict[str, Any]] = []
        for image in message.images:
            url = f"data:{image.media_type};base64,{b64encode(pictures[image.sha256]).decode()}"
            parts.append({"type": "text", "text": image.title})
            parts.append({"type": "image_url", "image_url": {"url": url, "detail": self._detail}})
        return {"role": role, "content": [*parts, {"type": "text", "text": message.content}]}

    def _read(self, answer: HttpAnswer) -> Completion:
        try:
            body = _Body.model_validate_json(unpacked(answer.body))
        except ValidationError:
            raise no_completion(answer.url, answer.body, "chat completion") from None
        choice = body.choices[0]
        finish = choice.finish_reason if isinstance(choice.finish_reason, str) else "stop"
        error = next(filter(is_error, (choice.error, body.error)), None)
        if finish == "error" or error is not None:
            raise broken_off(answer.url, error)
        if choice.message is None and finish.lower() not in CUT | FILTERED:
            raise MalformedCompletion(f"{answer.url} answered with a choice that has no message")
        said = (choice.message or _Message()).said(finish, self.answer_tokens)
        judged = judge(said)
        return Completion(
            text=judged.text,
            usage=self._usage(body.usage),
            finish=finish,
            model=model_name(body.model),
            verdict=judged.verdict,
            reason=judged.reason,
        )

    def _usage(self, said: object) -> Usage:
        prompt, completion = count(said, "prompt_tokens"), count(said, "completion_tokens")
        if not prompt or not completion:  # of a prompt and an answer that were read, none has 0 tokens
            return Usage(requests=1, unknown_requests=1)
        completion = max(completion, (count(said, "total_tokens") or 0) - prompt)  # some count reasoning apart
        cached = min(count(said, *self._profile.cached_path) or 0, prompt)
        return Usage(
            requests=1,
            prompt_tokens=prompt,
            completion_tokens=completion,
            cached_tokens=cached,
            reasoning_tokens=count(said, *self._profile.reasoning_path) or 0,
            cost_usd=self._prices.cost_usd(prompt=prompt, completion=completion, cached=cached),
        )


class _Message(BaseModel):
    """The message of a choice. Of what is no text for us any form is taken: it must not cost us the text."""

    content: str | list[Any] | None = None
    refusal: Any = None
    reasoning_content: Any = None
    reasoning: Any = None
    tool_calls: Any = None
    function_call: Any = None

    def said(self, finish: str, limit: int | None) -> AnswerParts:
        """Return it in common terms."""
        parts = self.content if isinstance(self.content, list) else []
        told = (self.reasoning_content, self.reasoning)
        thoughts = next((thoughts for thoughts in told if thoughts and isinstance(thoughts, str)), "")
        return AnswerParts(
            text=self.content if isinstance(self.content, str) else "".join(map(_text, parts)),
            finish=finish,
            refusal=self.refusal if isinstance(self.refusal, str) else "".join(map(_refusal, parts)),
            thoughts=thoughts,
            reasoned=any(_kind(part) in {"thinking", "reasoning"} for part in parts),
            tools=tuple(_tool_names(self.tool_calls, self.function_call)),
            limit=limit,
        )


class _Choice(BaseModel):
    message: _Message | None = None
    finish_reason: Any = None
    error: Any = None


class _Body(BaseModel):
    model: Any = None
    choices: Annotated[list[_Choice], Field(min_length=1)]
    usage: Any = None
    error: Any = None


def _folded(messages: Sequence[ChatMessage]) -> Sequence[ChatMessage]:
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


def _kind(part: object) -> object:
    return part.get("type", "text") if isinstance(part, dict) else None


def _text(part: object) -> str:
    if isinstance(part, str):
        return part
    words = part.get("text") if isinstance(part, dict) and _kind(part) in {"text", "output_text"} else ""
    return words if isinstance(words, str) else ""


def _refusal(part: object) -> str:
    words = part.get("refusal") if isinstance(part, dict) else ""
    return words if isinstance(words, str) else ""


def _tool_names(calls: object, call: object) -> list[str]:
    made = calls if isinstance(calls, list) else []
    functions = [each.get("function") for each in made if isinstance(each, dict)]
    return [str(function.get("name", "")) for function in [*functions, call] if isinstance(function, dict)]
