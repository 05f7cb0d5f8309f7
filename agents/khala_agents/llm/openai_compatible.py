"""OpenAI's chat completions, as spoken by nearly every endpoint, including Khala's own scripted one.

A row of `khala_agents.llm.profiles` says how an endpoint differs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Unpack

from pydantic import BaseModel, Field

from khala_agents.llm.asking import AnswerBody, ClientOptions, HttpClient, count
from khala_agents.llm.batches import OpenAIBatches
from khala_agents.llm.client import MalformedCompletion
from khala_agents.llm.effort import effort_fields
from khala_agents.llm.faults import broken_off, is_error
from khala_agents.llm.tokens import token_trace
from khala_agents.llm.verdict import CUT, FILTERED, AnswerParts, tool_words
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_agents.answers.form import AnswerShape
    from khala_agents.llm.client import Request
    from khala_agents.llm.effort import Effort
    from khala_agents.llm.profiles import Profile
    from khala_agents.llm.vision import Detail
    from khala_protocol.messages import TokenTrace


class _Message(BaseModel):
    """The message of a choice. Of what is no text for us any form is taken: it must not cost us the text."""

    content: str | list[Any] | None = None
    refusal: Any = None
    reasoning_content: Any = None
    reasoning: Any = None
    tool_calls: Any = None
    function_call: Any = None

    def take_apart(self, finish: str, limit: int | None) -> AnswerParts:
        """Return it in common terms."""
        parts = self.content if isinstance(self.content, list) else []
        reasoning = (self.reasoning_content, self.reasoning)
        thoughts = next((thoughts for thoughts in reasoning if thoughts and isinstance(thoughts, str)), "")
        return AnswerParts(
            text=self.content if isinstance(self.content, str) else "".join(map(_text, parts)),
            finish=finish,
            refusal=self.refusal if isinstance(self.refusal, str) else "".join(map(_refusal, parts)),
            thoughts=thoughts,
            reasoned=any(_kind(part) in {"thinking", "reasoning"} for part in parts),
            tools=tuple(_tools(self.tool_calls, self.function_call)),
            limit=limit,
        )


class _Choice(BaseModel):
    message: _Message | None = None
    finish_reason: Any = None
    error: Any = None
    logprobs: Any = None
    token_ids: Any = None


class _Answer(AnswerBody):
    choices: Annotated[list[_Choice], Field(min_length=1)]
    error: Any = None
    prompt_token_ids: Any = None


class OpenAICompatible(HttpClient[_Answer]):
    """An `LLMClient` for one model at one endpoint.

    Args:
        profile: the particulars of the endpoint.
        max_tokens: limit of generated tokens.
        temperature, seed, stop: sent if given and if the endpoint accepts them.
        reasoning_effort: how much the model thinks; None: as much as it does by default.
        detail: how finely the model looks at pictures.
        options: see `ClientOptions`.
    """

    PATH = "/chat/completions"
    ANSWER = _Answer
    CALLED = "chat completion"
    BATCHES = OpenAIBatches

    def __init__(
        self,
        profile: Profile,
        *,
        max_tokens: int | None = None,
        temperature: float | None = None,
        seed: int | None = None,
        stop: Sequence[str] = (),
        reasoning_effort: Effort | None = None,
        detail: Detail = "auto",
        **options: Unpack[ClientOptions],
    ) -> None:
        asked = {
            profile.length_field: max_tokens,
            "temperature": temperature if profile.temperature else None,
            "seed": seed if profile.seed else None,
            "stop": list(stop) or None if profile.stop else None,
            **effort_fields(profile.effort_field, reasoning_effort, options["model"]),
        }
        options["system_role"] = options.get("system_role") or profile.system_role
        super().__init__(asked, options)
        self._profile = profile
        self._detail = detail

    def _body(self, request: Request) -> dict[str, Any]:
        messages = [
            {
                "role": self._role if message.role == "system" else message.role,
                "content": self._content(message, request.pictures),
            }
            for message in self._prompt(request)
        ]
        return {"model": self.model, **self._fields_for(request), "messages": messages}

    def _shape(self, shape: AnswerShape) -> dict[str, Any]:
        if shape.schema and not self._profile.json_schema:
            return {"response_format": {"type": "json_object"}}
        if shape.schema:
            named = {"name": "answer", "strict": True, "schema": shape.schema}
            return {"response_format": {"type": "json_schema", "json_schema": named}}
        if shape.tools:
            functions = (
                {"name": tool.name, "description": tool.description, "parameters": tool.parameters}
                for tool in shape.tools
            )
            return {"tools": [{"type": "function", "function": function} for function in functions]}
        return {".".join(self._profile.grammar_field): shape.grammar}

    def _picture(self, media_type: str, data: str) -> dict[str, Any]:
        return {"type": "image_url", "image_url": {"url": f"data:{media_type};base64,{data}", "detail": self._detail}}

    def _take_apart(self, body: _Answer, url: str) -> AnswerParts:
        choice = body.choices[0]
        finish = choice.finish_reason if isinstance(choice.finish_reason, str) else "stop"
        error = next(filter(is_error, (choice.error, body.error)), None)
        if finish == "error" or error is not None:
            raise broken_off(url, error)
        if choice.message is None and finish.lower() not in CUT | FILTERED:
            raise MalformedCompletion(f"{url} answered with a choice that has no message")
        return (choice.message or _Message()).take_apart(finish, self.answer_tokens)

    def _tokens(self, body: _Answer) -> TokenTrace | None:
        choice = body.choices[0]
        return token_trace(body.prompt_token_ids, choice.token_ids, choice.logprobs)

    def _usage(self, counts: object) -> Usage:
        prompt = count(counts, "prompt_tokens")
        completion = count(counts, "completion_tokens")
        if not prompt or not completion:  # of a prompt and an answer that were read, none has 0 tokens
            return Usage(requests=1, unknown_requests=1)
        completion = max(completion, (count(counts, "total_tokens") or 0) - prompt)  # some count reasoning apart
        cached = min(count(counts, *self._profile.cached_path) or 0, prompt)
        return Usage(
            requests=1,
            prompt_tokens=prompt,
            completion_tokens=completion,
            cached_tokens=cached,
            reasoning_tokens=count(counts, *self._profile.reasoning_path) or 0,
            cost_usd=self._prices.cost_usd(prompt=prompt, completion=completion, cached=cached),
        )


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


def _tools(calls: object, call: object) -> Iterator[str]:
    """Yield the tools that a message calls, in words."""
    made = calls if isinstance(calls, list) else []
    functions = [each.get("function") for each in made if isinstance(each, dict)]
    for function in [*functions, call]:
        if isinstance(function, dict) and function.get("name"):
            yield tool_words(function["name"], function.get("arguments"))
