"""Gemini's own API (`generateContent`): at Google AI for Developers, and by other addresses on Vertex AI."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Unpack

from pydantic import Field, model_validator

from khala_agents.llm.asking import AnswerBody, ClientOptions, HttpClient, count
from khala_agents.llm.effort import effort_fields
from khala_agents.llm.schemas import in_openapi
from khala_agents.llm.verdict import AnswerParts, tool_words
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from khala_agents.answers.form import AnswerShape, Tool
    from khala_agents.llm.client import Request
    from khala_agents.llm.effort import Effort
    from khala_agents.llm.profiles import Profile


class _Answer(AnswerBody):
    model: Any = Field(default=None, alias="modelVersion")
    usage: Any = Field(default=None, alias="usageMetadata")
    candidates: tuple[Any, ...] = ()
    feedback: Any = Field(default=None, alias="promptFeedback")

    @model_validator(mode="after")
    def _answers(self) -> _Answer:
        if not self.candidates and not self.block_reason:
            raise ValueError("there is neither a candidate nor a reason why")
        return self

    @property
    def block_reason(self) -> str:
        """Why the prompt was blocked; "" if it was not."""
        return _text(self.feedback, "blockReason")


class Gemini(HttpClient[_Answer]):
    """An `LLMClient` for one model.

    Args:
        profile: the particulars of the endpoint.
        max_tokens: limit of generated tokens, those of its thoughts too.
        temperature, seed, stop: sent if given.
        reasoning_effort: how much the model thinks; None: as much as it does by default.
        options: see `ClientOptions`.
    """

    PATH = "/models/{model}:generateContent"
    ANSWER = _Answer
    CALLED = "candidate"
    KEY_HEADER = ("x-goog-api-key", "")
    _CONFIG: ClassVar = "generationConfig"

    def __init__(
        self,
        profile: Profile,
        *,
        max_tokens: int | None = None,
        temperature: float | None = None,
        seed: int | None = None,
        stop: Sequence[str] = (),
        reasoning_effort: Effort | None = None,
        **options: Unpack[ClientOptions],
    ) -> None:
        asked = {
            f"{self._CONFIG}.{profile.length_field}": max_tokens,
            f"{self._CONFIG}.temperature": temperature,
            f"{self._CONFIG}.seed": seed,
            f"{self._CONFIG}.stopSequences": list(stop) or None,
            **effort_fields(profile.effort_field, reasoning_effort, options["model"]),
        }
        options["system_role"] = options.get("system_role") or profile.system_role
        super().__init__(asked, options)
        self._profile = profile

    def _body(self, request: Request) -> dict[str, Any]:
        prompt = self._prompt(request)
        system = "\n\n".join(message.content for message in prompt if message.role == "system")
        contents = [
            {
                "role": "model" if message.role == "assistant" else "user",
                "parts": self._parts(message, request.pictures),
            }
            for message in prompt
            if message.role != "system"
        ]
        instruction = {"systemInstruction": {"parts": [{"text": system}]}} if system else {}
        return {**self._fields_for(request), **instruction, "contents": contents}

    def _shape(self, shape: AnswerShape) -> dict[str, Any]:
        if shape.schema:
            return {
                f"{self._CONFIG}.responseMimeType": "application/json",
                f"{self._CONFIG}.responseSchema": in_openapi(shape.schema),
            }
        return {
            "tools": [{"functionDeclarations": [_declaration(tool) for tool in shape.tools]}],
            # text or calls, and these held to their schemas
            "toolConfig": {"functionCallingConfig": {"mode": "VALIDATED"}},
        }

    def _words(self, text: str) -> dict[str, Any]:
        return {"text": text}

    def _picture(self, media_type: str, data: str) -> dict[str, Any]:
        return {"inlineData": {"mimeType": media_type, "data": data}}

    def _take_apart(self, body: _Answer, url: str) -> AnswerParts:  # noqa: ARG002  # any candidate is an answer
        candidate = body.candidates[0] if body.candidates else {}
        content = candidate.get("content") if isinstance(candidate, dict) else None
        found = content.get("parts") if isinstance(content, dict) else None
        parts = [part for part in found if isinstance(part, dict)] if isinstance(found, list) else []
        return AnswerParts(
            text="".join(_text(part, "text") for part in parts if not part.get("thought")),
            finish=_text(candidate, "finishReason") or "STOP",
            reasoned=any(part.get("thought") for part in parts) or bool(count(body.usage, "thoughtsTokenCount")),
            tools=tuple(_calls(parts)),
            limit=self.answer_tokens,
            blocked=body.block_reason,
        )

    def _usage(self, counts: object) -> Usage:
        """Return the usage in our terms: Gemini counts thoughts apart from the answer."""
        prompt = (count(counts, "promptTokenCount") or 0) + (count(counts, "toolUsePromptTokenCount") or 0)
        thoughts = count(counts, *self._profile.reasoning_path) or 0
        written = (count(counts, "candidatesTokenCount") or 0) + thoughts
        written = max(written, (count(counts, "totalTokenCount") or 0) - prompt)
        if not prompt or not written:  # of a prompt and an answer that were read, none has 0 tokens
            return Usage(requests=1, unknown_requests=1)
        cached = min(count(counts, *self._profile.cached_path) or 0, prompt)
        return Usage(
            requests=1,
            prompt_tokens=prompt,
            completion_tokens=written,
            cached_tokens=cached,
            reasoning_tokens=thoughts,
            cost_usd=self._prices.cost_usd(prompt=prompt, completion=written, cached=cached),
        )


def _declaration(tool: Tool) -> dict[str, Any]:
    """Return a tool as the API wants it: an object without fields is refused."""
    named = {"name": tool.name, "description": tool.description}
    return {**named, "parameters": in_openapi(tool.parameters)} if tool.parameters.get("properties") else named


def _calls(parts: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the functions that are called, in words."""
    for part in parts:
        call = part.get("functionCall")
        if isinstance(call, dict):
            yield tool_words(call.get("name"), call.get("args"))


def _text(value: object, field: str) -> str:
    text = value.get(field) if isinstance(value, dict) else None
    return text if isinstance(text, str) else ""
