"""Anthropic's messages API, natively: their OpenAI-compatible layer is meant for tests and ignores parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Unpack

from khala_agents.llm.asking import AnswerBody, ClientOptions, HttpClient, count
from khala_agents.llm.batches import AnthropicBatches
from khala_agents.llm.effort import effort_fields
from khala_agents.llm.quirks import CACHE_MARK
from khala_agents.llm.schemas import LIMITING, without
from khala_agents.llm.verdict import AnswerParts, tool_words
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from khala_agents.answers.form import AnswerShape
    from khala_agents.llm.client import Request
    from khala_agents.llm.effort import Effort

_REFUSED = LIMITING - {"pattern"}
"""Limits of numbers, texts and lists, which the API refuses in schemas."""


class _Answer(AnswerBody):
    content: list[Any]
    stop_reason: Any = None


class Anthropic(HttpClient[_Answer]):
    """An `LLMClient` for one Claude model.

    Args:
        max_tokens: limit of generated tokens; the API requires one.
        temperature, stop: sent if given.
        reasoning_effort: how much the model thinks; None: as much as it does by default.
        options: see `ClientOptions`.
    """

    PATH = "/messages"
    ANSWER = _Answer
    CALLED = "message"
    KEY_HEADER = ("x-api-key", "")
    HEADERS: ClassVar = {"anthropic-version": "2023-06-01"}
    MARKS_CACHE = True
    BATCHES = AnthropicBatches

    def __init__(
        self,
        *,
        max_tokens: int = 1024,
        temperature: float | None = None,
        stop: Sequence[str] = (),
        reasoning_effort: Effort | None = None,
        **options: Unpack[ClientOptions],
    ) -> None:
        asked = {
            "max_tokens": max_tokens,
            "temperature": temperature,
            "stop_sequences": list(stop) or None,
            **effort_fields("output_config.effort", reasoning_effort, options["model"]),
        }
        super().__init__(asked, options)

    def _body(self, request: Request) -> dict[str, Any]:
        system = "\n\n".join(message.content for message in request.messages if message.role == "system")
        marks = request.stable if CACHE_MARK not in self.quirks.left_out else 0
        turns: list[dict[str, Any]] = []
        for place, message in enumerate(request.messages):
            if message.role != "system":
                is_marked = place == marks - 1
                content = _cached_content(message.content) if is_marked else self._content(message, request.pictures)
                turns.append({"role": message.role, "content": content})
        body: dict[str, Any] = {"model": self.model, **self._fields_for(request), "messages": turns}
        if system:
            body["system"] = _cached_content(system) if marks else system
        return body

    def _shape(self, shape: AnswerShape) -> dict[str, Any]:
        if shape.schema:
            return {"output_config.format": {"type": "json_schema", "schema": without(shape.schema, _REFUSED)}}
        tools = [
            {"name": tool.name, "description": tool.description, "input_schema": tool.parameters}
            for tool in shape.tools
        ]
        return {"tools": tools}

    def _picture(self, media_type: str, data: str) -> dict[str, Any]:
        return {"type": "image", "source": {"type": "base64", "media_type": media_type, "data": data}}

    def _take_apart(self, body: _Answer, url: str) -> AnswerParts:  # noqa: ARG002  # any list is a message
        blocks = [block for block in body.content if isinstance(block, dict)]
        return AnswerParts(
            text="".join(_text(block) for block in blocks if block.get("type") == "text"),
            finish=body.stop_reason if isinstance(body.stop_reason, str) else "end_turn",
            reasoned=any(block.get("type") in {"thinking", "redacted_thinking"} for block in blocks),
            tools=tuple(
                tool_words(block.get("name"), block.get("input")) for block in blocks if block.get("type") == "tool_use"
            ),
            limit=self.answer_tokens,
        )

    def _usage(self, counts: object) -> Usage:
        """Return the usage in our terms: Anthropic counts cached tokens separately from `input_tokens`."""
        read = count(counts, "input_tokens")
        written = count(counts, "output_tokens")
        cached = count(counts, "cache_read_input_tokens") or 0
        kept = count(counts, "cache_creation_input_tokens") or 0
        prompt = (read or 0) + cached + kept
        if read is None or not prompt or not written:  # of a prompt and an answer that were read, none has 0 tokens
            return Usage(requests=1, unknown_requests=1)
        return Usage(
            requests=1,
            prompt_tokens=prompt,
            completion_tokens=written,
            cached_tokens=cached,
            cache_write_tokens=kept,
            cost_usd=self._prices.cost_usd(prompt=prompt, completion=written, cached=cached, cache_write=kept),
        )


def _cached_content(text: str) -> list[dict[str, Any]]:
    """Return the content of a message up to whose end a prompt is cached: the same in all requests of an episode."""
    return [{"type": "text", "text": text, CACHE_MARK: {"type": "ephemeral"}}]


def _text(block: Mapping[str, Any]) -> str:
    text = block.get("text")
    return text if isinstance(text, str) else ""
