"""OpenAI's Responses API, at OpenAI, Azure, and servers that follow it; nothing is kept there (`store: false`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

from khala_agents.llm.asking import AnswerBody, ClientOptions, HttpClient, count
from khala_agents.llm.batches import OpenAIBatches
from khala_agents.llm.effort import effort_fields
from khala_agents.llm.faults import broken_off, fault_of, is_error
from khala_agents.llm.verdict import AnswerParts, tool_words
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from khala_agents.answers.form import AnswerShape
    from khala_agents.llm.client import Request
    from khala_agents.llm.effort import Effort
    from khala_agents.llm.profiles import Profile
    from khala_agents.llm.vision import Detail


class _Answer(AnswerBody):
    output: list[Any]
    status: Any = None
    incomplete_details: Any = None
    error: Any = None


class Responses(HttpClient[_Answer]):
    """An `LLMClient` for one model.

    Args:
        profile: the particulars of the endpoint.
        max_tokens: limit of generated tokens, those of its reasoning too.
        temperature: sent if given.
        reasoning_effort: how much the model thinks; None: as much as it does by default.
        detail: how finely the model looks at pictures.
        options: see `ClientOptions`.
    """

    PATH = "/responses"
    ANSWER = _Answer
    CALLED = "response"
    BATCHES = OpenAIBatches

    def __init__(
        self,
        profile: Profile,
        *,
        max_tokens: int | None = None,
        temperature: float | None = None,
        reasoning_effort: Effort | None = None,
        detail: Detail = "auto",
        **options: Unpack[ClientOptions],
    ) -> None:
        asked = {
            profile.length_field: max_tokens,
            "temperature": temperature,
            "store": False,
            **effort_fields(profile.effort_field, reasoning_effort, options["model"]),
        }
        options["system_role"] = options.get("system_role") or profile.system_role
        super().__init__(asked, options)
        self._profile = profile
        self._detail = detail

    def _body(self, request: Request) -> dict[str, Any]:
        prompt = self._prompt(request)
        system = "\n\n".join(message.content for message in prompt if message.role == "system")
        turns = [
            {"role": message.role, "content": self._content(message, request.pictures)}
            for message in prompt
            if message.role != "system"
        ]
        instructions = {"instructions": system} if system else {}
        return {"model": self.model, **self._fields_for(request), **instructions, "input": turns}

    def _shape(self, shape: AnswerShape) -> dict[str, Any]:
        if shape.schema:
            return {"text.format": {"type": "json_schema", "name": "answer", "strict": True, "schema": shape.schema}}
        tools = [
            {
                "type": "function",
                "name": tool.name,
                "description": tool.description,
                "parameters": tool.parameters,
                "strict": False,  # the API's default would refuse arguments that may be left out
            }
            for tool in shape.tools
        ]
        return {"tools": tools}

    def _words(self, text: str) -> dict[str, Any]:
        return {"type": "input_text", "text": text}

    def _picture(self, media_type: str, data: str) -> dict[str, Any]:
        return {"type": "input_image", "image_url": f"data:{media_type};base64,{data}", "detail": self._detail}

    def _take_apart(self, body: _Answer, url: str) -> AnswerParts:
        blocked = ""
        if is_error(body.error) or body.status == "failed":
            fault = fault_of(body.error)
            if "invalid_prompt" not in fault.names:
                raise broken_off(url, body.error)
            blocked = fault.message
        items = [item for item in body.output if isinstance(item, dict)]
        parts = [part for item in items if item.get("type") == "message" for part in _list(item.get("content"))]
        return AnswerParts(
            text="".join(_said(parts, "output_text", "text")),
            finish=_reason(body.incomplete_details) or "stop",
            refusal="".join(_said(parts, "refusal", "refusal")),
            reasoned=any(item.get("type") == "reasoning" for item in items),
            tools=tuple(
                tool_words(item.get("name"), item.get("arguments"))
                for item in items
                if item.get("type") == "function_call"
            ),
            limit=self.answer_tokens,
            blocked=blocked,
        )

    def _usage(self, counts: object) -> Usage:
        prompt = count(counts, "input_tokens")
        completion = count(counts, "output_tokens")
        if not prompt or not completion:  # of a prompt and an answer that were read, none has 0 tokens
            return Usage(requests=1, unknown_requests=1)
        cached = min(count(counts, *self._profile.cached_path) or 0, prompt)
        return Usage(
            requests=1,
            prompt_tokens=prompt,
            completion_tokens=completion,
            cached_tokens=cached,
            reasoning_tokens=count(counts, *self._profile.reasoning_path) or 0,
            cost_usd=self._prices.cost_usd(prompt=prompt, completion=completion, cached=cached),
        )


def _reason(details: object) -> str:
    """Return why an answer is incomplete, "" if it is not said."""
    reason = details.get("reason") if isinstance(details, dict) else None
    return reason if isinstance(reason, str) else ""


def _list(value: object) -> list[Any]:
    return value if isinstance(value, list) else []


def _said(parts: list[Any], kind: str, field: str) -> Iterator[str]:
    """Yield the texts of the parts of one kind."""
    for part in parts:
        words: Mapping[str, Any] = part if isinstance(part, dict) and part.get("type") == kind else {}
        if isinstance(text := words.get(field), str):
            yield text
