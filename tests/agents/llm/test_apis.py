"""What each API is asked for a model file, and after a refusal: the exact body of a request, and what is read."""

from __future__ import annotations

import base64
import hashlib
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.answers.form import AnswerShape, Tool
from khala_agents.build import client_for
from khala_agents.config import ModelConfig
from khala_agents.llm.client import (
    Completion,
    EndpointUnavailable,
    LLMError,
    MalformedCompletion,
    Request,
    RequestRefused,
    Unauthorized,
)
from khala_agents.scripted.canned import Canned, CannedRequest, Given, completion, refusal
from khala_protocol.messages import ChatMessage, ImageRef
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from khala_agents.llm.client import LLMClient

PROMPT = (
    ChatMessage(role="system", content="You play."),
    ChatMessage(role="user", content="Game"),
    ChatMessage(role="assistant", content="Actions:"),
    ChatMessage(role="user", content="now"),
)
KEY = "sk-0123456789"
ANSWERS: dict[str, Any] = {
    "chat": completion("go", usage={"prompt_tokens": 100, "completion_tokens": 10}).body,
    "responses": {
        "status": "completed",
        "output": [{"type": "message", "role": "assistant", "content": [{"type": "output_text", "text": "go"}]}],
        "usage": {"input_tokens": 100, "output_tokens": 10},
    },
    "anthropic": {"content": [{"type": "text", "text": "go"}], "usage": {"input_tokens": 100, "output_tokens": 10}},
    "gemini": {
        "candidates": [{"content": {"role": "model", "parts": [{"text": "go"}]}, "finishReason": "STOP"}],
        "usageMetadata": {"promptTokenCount": 100, "candidatesTokenCount": 10},
    },
}
TURNS = [
    {"role": "user", "content": "Game"},
    {"role": "assistant", "content": "Actions:"},
    {"role": "user", "content": "now"},
]
MESSAGES = {"messages": [{"role": "system", "content": "You play."}, *TURNS]}
CONTENTS = [
    {"role": "user", "parts": [{"text": "Game"}]},
    {"role": "model", "parts": [{"text": "Actions:"}]},
    {"role": "user", "parts": [{"text": "now"}]},
]
PROMPTS: dict[str, dict[str, Any]] = {
    "chat": {"model": "m", **MESSAGES},
    "responses": {"model": "m", "store": False, "instructions": "You play.", "input": TURNS},
    "anthropic": {"model": "m", "max_tokens": 1024, "system": "You play.", "messages": TURNS},
    "gemini": {"systemInstruction": {"parts": [{"text": "You play."}]}, "contents": CONTENTS},
}
"""What each API is sent of the prompt."""


def model(server: Canned, profile: str, **fields: Any) -> LLMClient:
    config: dict[str, Any] = {"profile": profile, "model": "m", "base_url": server.base_url, "api_key_env": "API_KEY"}
    return client_for(ModelConfig.model_validate(config | {"prices": {"prompt": 1, "completion": 10}} | fields))


async def ask(client: LLMClient, shape: AnswerShape | None = None, **changes: Any) -> Completion:
    request: dict[str, Any] = {"messages": PROMPT, "timeout_s": 5.0, "shape": shape}
    try:
        return await client.complete(Request(**request | changes))
    finally:
        await client.close()


def api_of(profile: str) -> str:
    return profile if profile in ANSWERS else "chat"


@pytest.fixture(autouse=True)
def key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("API_KEY", KEY)


# --- what a model file says ---------------------------------------------------------------------------

SAID: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
    ("openai", {"stop": ["END"], "reasoning_effort": "low"}, {"stop": ["END"], "reasoning_effort": "low"}),
    ("openai", {"max_tokens": 50, "temperature": 0.5, "seed": 3},
     {"max_completion_tokens": 50, "temperature": 0.5, "seed": 3}),
    ("ollama", {"reasoning_effort": "none"}, {"reasoning_effort": "none"}),
    ("deepseek", {"reasoning_effort": "none", "seed": 3}, {"thinking": {"type": "disabled"}}),
    ("glm", {"reasoning_effort": "high"}, {"thinking": {"type": "enabled"}}),
    ("qwen", {"reasoning_effort": "none", "stop": ["END"]}, {"enable_thinking": False, "stop": ["END"]}),
    ("openrouter", {"reasoning_effort": "minimal"}, {"reasoning": {"effort": "minimal"}}),
    ("vllm", {"reasoning_effort": "none"},
     {"chat_template_kwargs": {"enable_thinking": False, "reasoning_effort": "none"}}),
    ("llamacpp", {"reasoning_effort": "high", "stop": ["a", "b"]},
     {"chat_template_kwargs": {"enable_thinking": True, "reasoning_effort": "high"}, "stop": ["a", "b"]}),
    ("deepseek", {"reasoning_effort": "none", "extra": {"thinking": {"keep": 1}}},
     {"thinking": {"type": "disabled", "keep": 1}}),
    ("responses", {"reasoning_effort": "high", "max_tokens": 50, "temperature": 0.5},
     {"reasoning": {"effort": "high"}, "max_output_tokens": 50, "temperature": 0.5}),
    ("anthropic", {"reasoning_effort": "minimal", "stop": ["END"]},
     {"output_config": {"effort": "low"}, "stop_sequences": ["END"]}),
    ("anthropic", {"reasoning_effort": "none"}, {"thinking": {"type": "disabled"}}),
    ("gemini", {"reasoning_effort": "none", "stop": ["END"], "max_tokens": 50, "temperature": 0.5, "seed": 3},
     {"generationConfig": {"thinkingConfig": {"thinkingLevel": "minimal"}, "stopSequences": ["END"],
                           "maxOutputTokens": 50, "temperature": 0.5, "seed": 3}}),
    ("gemini", {"max_tokens": 50, "extra": {"generationConfig": {"topK": 1}}},
     {"generationConfig": {"maxOutputTokens": 50, "topK": 1}}),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "fields", "sent"), SAID)
async def test_a_request_is_in_the_words_of_its_api(profile: str, fields: dict[str, Any], sent: dict[str, Any]) -> None:
    api = api_of(profile)
    async with Canned(Given(ANSWERS[api])) as server:
        found = await ask(model(server, profile, **fields))
    (asked,) = server.asked
    assert asked.body == PROMPTS[api] | sent
    assert (found.text, found.verdict, found.usage.prompt_tokens, found.usage.completion_tokens) == (
        "go",
        "ok",
        100,
        10,
    )
    assert found.usage.cost_usd == pytest.approx(200e-6)


@pytest.mark.parametrize(
    ("name", "effort", "config"),
    [
        ("gemini-2.5-flash", "none", {"thinkingBudget": 0}),
        ("gemini-2.5-pro", "medium", {"thinkingBudget": 8192}),
        ("gemini-2.5-pro", "max", {"thinkingBudget": 24576}),
        ("gemini-3.8-flash", "medium", {"thinkingLevel": "medium"}),
        ("gemini-3.8-flash", "max", {"thinkingLevel": "high"}),
    ],
)
async def test_gemini_thinks_by_a_budget_before_3_and_by_a_level_from_then_on(
    name: str, effort: str, config: dict[str, Any]
) -> None:
    async with Canned(Given(ANSWERS["gemini"])) as server:
        client = model(server, "gemini", model=name, reasoning_effort=effort)
        await ask(client)
    (asked,) = server.asked
    assert asked.body["generationConfig"] == {"thinkingConfig": config}
    assert asked.path == f"/v1/models/{name}:generateContent"
    (shown,) = client.params.items()
    assert shown == (f"generationConfig.thinkingConfig.{next(iter(config))}", next(iter(config.values()))), "recorded"


WAYS = [
    ("openai", "/v1/chat/completions", ("authorization", f"Bearer {KEY}")),
    ("responses", "/v1/responses", ("authorization", f"Bearer {KEY}")),
    ("anthropic", "/v1/messages", ("x-api-key", KEY)),
    ("gemini", "/v1/models/m:generateContent", ("x-goog-api-key", KEY)),
]


@pytest.mark.parametrize(("profile", "path", "header"), WAYS)
async def test_a_request_goes_to_the_path_of_its_api_with_its_key(
    profile: str, path: str, header: tuple[str, str]
) -> None:
    async with Canned(Given(ANSWERS[api_of(profile)])) as server:
        await ask(model(server, profile, base_url=server.root + path))  # as people copy it
    (asked,) = server.asked
    assert (asked.path, asked.headers[header[0]]) == (path, header[1])


# --- forms of answers -----------------------------------------------------------------------------------

SCHEMA: dict[str, Any] = {
    "type": "object",
    "properties": {
        "say": {"type": "string", "maxLength": 9},
        "tag": {"$ref": "#/$defs/list1"},
        "until": {"type": ["string", "null"]},
        "at": {"type": "array", "items": {"type": "number", "minimum": 0}, "maxItems": 2},
    },
    "required": ["say", "tag", "until", "at"],
    "additionalProperties": False,
    "$defs": {"list1": {"type": "string", "enum": ["0x1", "0x2"]}},
}
PLAIN = SCHEMA | {"properties": {**SCHEMA["properties"], "say": {"type": "string"},
                                 "at": {"type": "array", "items": {"type": "number"}}}}  # fmt: skip
OPENAPI: dict[str, Any] = {
    "type": "object",
    "properties": {
        "say": {"type": "string", "maxLength": 9},
        "tag": {"type": "string", "enum": ["0x1", "0x2"]},
        "until": {"type": "string", "nullable": True},
        "at": {"type": "array", "items": {"type": "number", "minimum": 0}, "maxItems": 2},
    },
    "required": ["say", "tag", "until", "at"],
    "propertyOrdering": ["say", "tag", "until", "at"],
}
MOVE = Tool("Move", "Go.", {"type": "object", "properties": {"to": {"type": "string"}}, "required": ["to"],
                            "additionalProperties": False})  # fmt: skip
MOVE_IN_OPENAPI: dict[str, Any] = {"type": "object", "properties": {"to": {"type": "string"}}, "required": ["to"],
                   "propertyOrdering": ["to"]}  # fmt: skip
STOP = Tool("Stop", "Stand.", {"type": "object", "properties": {}})
JSON, TOOLS, GRAMMAR = AnswerShape(schema=SCHEMA), AnswerShape(tools=(MOVE, STOP)), AnswerShape(grammar="root ::= x")


def function(tool: Tool) -> dict[str, Any]:
    return {"name": tool.name, "description": tool.description, "parameters": tool.parameters}


FORMS: list[tuple[str, AnswerShape, dict[str, Any]]] = [
    ("openai", JSON, {"response_format": {"type": "json_schema", "json_schema": {
        "name": "answer", "strict": True, "schema": SCHEMA}}}),
    ("deepseek", JSON, {"response_format": {"type": "json_object"}}),
    ("glm", JSON, {"response_format": {"type": "json_object"}}),
    ("qwen", JSON, {"response_format": {"type": "json_object"}}),
    ("openai", TOOLS, {"tools": [{"type": "function", "function": function(tool)} for tool in (MOVE, STOP)]}),
    ("llamacpp", GRAMMAR, {"grammar": "root ::= x"}),
    ("vllm", GRAMMAR, {"structured_outputs": {"grammar": "root ::= x"}}),
    ("responses", JSON, {"text": {"format": {"type": "json_schema", "name": "answer", "strict": True,
                                             "schema": SCHEMA}}}),
    ("responses", TOOLS, {"tools": [{"type": "function", **function(tool), "strict": False} for tool in (MOVE, STOP)]}),
    ("anthropic", JSON, {"output_config": {"format": {"type": "json_schema", "schema": PLAIN}}}),
    ("anthropic", TOOLS, {"tools": [{"name": tool.name, "description": tool.description,
                                     "input_schema": tool.parameters} for tool in (MOVE, STOP)]}),
    ("gemini", JSON, {"generationConfig": {"responseMimeType": "application/json", "responseSchema": OPENAPI}}),
    ("gemini", TOOLS, {"tools": [{"functionDeclarations": [
        {"name": "Move", "description": "Go.", "parameters": MOVE_IN_OPENAPI},
        {"name": "Stop", "description": "Stand."},
    ]}], "toolConfig": {"functionCallingConfig": {"mode": "VALIDATED"}}}),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "shape", "sent"), FORMS)
async def test_a_form_is_asked_for_in_the_words_of_its_api(
    profile: str, shape: AnswerShape, sent: dict[str, Any]
) -> None:
    api = api_of(profile)
    async with Canned(Given(ANSWERS[api])) as server:
        await ask(model(server, profile), shape)
    (asked,) = server.asked
    assert asked.body == PROMPTS[api] | sent


async def test_how_much_claude_thinks_stands_beside_the_form_of_its_answer() -> None:
    async with Canned(Given(ANSWERS["anthropic"])) as server:
        await ask(model(server, "anthropic", reasoning_effort="high"), JSON)
    assert server.asked[0].body["output_config"].keys() == {"effort", "format"}


CALL = {"team": "A", "tag": "0x1"}
CALLED = [
    ("openai", completion(None, tool_calls=[{"function": {"name": "Attack_Unit", "arguments": '{"team":"A",'
     '"tag":"0x1"}'}}]).body),
    ("responses", {"status": "completed", "output": [
        {"type": "reasoning", "summary": []},
        {"type": "function_call", "name": "Attack_Unit", "arguments": '{"team": "A", "tag": "0x1"}'}]}),
    ("anthropic", {"content": [{"type": "tool_use", "name": "Attack_Unit", "input": CALL}]}),
    ("gemini", {"candidates": [{"content": {"parts": [{"functionCall": {"name": "Attack_Unit", "args": CALL}}]}}]}),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "answer"), CALLED)
async def test_a_call_of_a_tool_is_read_as_an_order(profile: str, answer: Any) -> None:
    async with Canned(Given(answer)) as server:
        found = await ask(model(server, profile), TOOLS)
    assert [(call.team, call.name, call.args) for call in parse(found.text).calls] == [("A", "Attack_Unit", ("0x1",))]
    assert found.reason == "", "tools were offered"


# --- what endpoints refuse ------------------------------------------------------------------------------

EFFORT = {"reasoning_effort": "high"}
ENDS = {"stop": ["END"]}
UNSUPPORTED = "Unsupported parameter: '{}' is not supported with this model."
LIMITS_REFUSED = "For 'number' type, properties maximum, minimum are not supported"
NO_LENGTHS = (
    "Invalid schema for response_format 'answer': In context=('properties', 'say'), 'maxLength' is not permitted."
)
UNKNOWN = "Invalid JSON payload received. Unknown name \"seed\" at 'generation_config': Cannot find field."
TOO_COMPLEX = "The specified schema produces a constraint that has too many states for serving."
REFUSALS: list[tuple[str, dict[str, Any], AnswerShape | None, str, dict[str, Any]]] = [
    ("openai", ENDS, None, UNSUPPORTED.format("stop"), {}),
    ("openai", EFFORT, None, "Unrecognized request argument supplied: reasoning_effort", {}),
    ("ollama", EFFORT, None, '"gemma3:4b" does not support thinking', {}),
    ("ollama", {}, TOOLS, "registry.ollama.ai/library/gemma3:4b does not support tools", {}),
    ("openai", {}, JSON, NO_LENGTHS, {"response_format": {"type": "json_schema", "json_schema": {
         "name": "answer", "strict": True, "schema": SCHEMA | {
             "properties": {**SCHEMA["properties"], "say": {"type": "string"}}}}}}),
    ("compatible", {}, JSON, "This response_format type is unavailable now", {}),
    ("glm", EFFORT, None, "thinking: Extra inputs are not permitted", {}),
    ("responses", EFFORT, None, UNSUPPORTED.format("reasoning.effort"), {}),
    ("responses", {"temperature": 0.5}, None, UNSUPPORTED.format("temperature"), {}),
    ("responses", {}, JSON, UNSUPPORTED.format("text.format"), {}),
    ("anthropic", EFFORT, JSON, "This model does not support the effort parameter.",
     {"output_config": {"format": {"type": "json_schema", "schema": PLAIN}}}),
    ("anthropic", EFFORT, JSON, "output_config.format: Extra inputs are not permitted",
     {"output_config": {"effort": "high"}}),
    ("anthropic", ENDS, None, "stop_sequences: Extra inputs are not permitted", {}),
    ("compatible", {}, JSON, LIMITS_REFUSED, {"response_format": {"type": "json_schema", "json_schema": {
        "name": "answer", "strict": True, "schema": SCHEMA | {
            "properties": {**SCHEMA["properties"], "at": {"type": "array", "items": {"type": "number"},
                                                          "maxItems": 2}}}}}}),
    ("gemini", {"seed": 3}, None, UNKNOWN, {}),
    ("gemini", EFFORT, None, "Thinking level is not supported for this model.", {}),
    ("gemini", EFFORT | {"max_tokens": 9}, None, "Budget 0 is invalid. This model only works in thinking mode.",
     {"generationConfig": {"maxOutputTokens": 9}}),
    ("gemini", {}, JSON, "JSON mode is not enabled for models/gemma-3-27b-it", {}),
    ("gemini", {}, TOOLS, "Function calling is not enabled for models/gemma-3-27b-it", {}),
    ("gemini", {}, JSON, TOO_COMPLEX, {"generationConfig": {
        "responseMimeType": "application/json", "responseSchema": OPENAPI | {"properties": {
            **OPENAPI["properties"], "say": {"type": "string"}, "at": {"type": "array", "items": {"type": "number"}},
        }}}}),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "fields", "shape", "words", "sent"), REFUSALS)
async def test_what_an_endpoint_refuses_is_left_out_and_nothing_else(
    profile: str, fields: dict[str, Any], shape: AnswerShape | None, words: str, sent: dict[str, Any]
) -> None:
    api = api_of(profile)
    async with Canned(lambda _: refusal(400, words) if len(server.asked) == 1 else Given(ANSWERS[api])) as server:
        client = model(server, profile, **fields)
        for _ in range(2):
            assert (await ask(client, shape)).text == "go"
    first, second, third = (asked.body for asked in server.asked)
    assert first != second
    assert second == third == PROMPTS[api] | sent


async def test_a_schema_that_stays_too_complex_is_left_out() -> None:
    def answer(asked: CannedRequest) -> Given:
        has_schema = "responseSchema" in asked.body.get("generationConfig", {})
        return refusal(400, TOO_COMPLEX) if has_schema else Given(ANSWERS["gemini"])

    async with Canned(answer) as server:
        await ask(model(server, "gemini"), JSON)
    assert len(server.asked) == 3
    assert server.asked[-1].body == PROMPTS["gemini"]


NO_SYSTEM = [
    ("gemini", "Developer instruction is not enabled for models/gemma-3-27b-it", "contents"),
    ("responses", "System role not supported", "input"),
    ("llamacpp", "System role not supported", "messages"),
]


@pytest.mark.parametrize(("profile", "words", "field"), NO_SYSTEM)
async def test_a_refused_system_message_goes_in_front_of_the_first_of_the_user(
    profile: str, words: str, field: str
) -> None:
    api = api_of(profile)
    async with Canned(lambda _: refusal(400, words) if len(server.asked) == 1 else Given(ANSWERS[api])) as server:
        await ask(model(server, profile))
        await ask(model(server, profile, system_role="fold"))
    for asked in server.asked[1:]:
        assert not asked.body.keys() & {"instructions", "systemInstruction"}
        first, *others = asked.body[field]
        assert first["role"] == "user"
        assert "You play.\\n\\nGame" in str(first)
        assert len(others) == 2


async def test_the_limit_of_tokens_is_never_left_out() -> None:
    async with Canned(refusal(400, UNSUPPORTED.format("max_output_tokens"))) as server:
        with pytest.raises(RequestRefused):
            await ask(model(server, "responses", max_tokens=9))
    assert len(server.asked) == 1


# --- pictures -------------------------------------------------------------------------------------------

PNG = b"\x89PNG"
PICTURE = ImageRef(
    name="map",
    title="The map",
    sha256=hashlib.sha256(PNG).hexdigest(),
    width=64,
    height=64,
    bytes=len(PNG),
    media_type="image/png",
)
DATA = base64.b64encode(PNG).decode()
SEEN: list[tuple[str, str, Any]] = [
    ("gemini", "contents", {"role": "user", "parts": [
        {"text": "The map"}, {"inlineData": {"mimeType": "image/png", "data": DATA}}, {"text": "Game"}]}),
    ("responses", "input", {"role": "user", "content": [
        {"type": "input_text", "text": "The map"},
        {"type": "input_image", "image_url": f"data:image/png;base64,{DATA}", "detail": "low"},
        {"type": "input_text", "text": "Game"}]}),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "field", "message"), SEEN)
async def test_a_picture_is_sent_in_the_words_of_its_api(profile: str, field: str, message: Any) -> None:
    prompt = (ChatMessage(role="user", content="Game", images=(PICTURE,)),)
    async with Canned(Given(ANSWERS[profile])) as server:
        client = model(server, profile, images={"detail": "low"})
        await ask(client, messages=prompt, pictures={PICTURE.sha256: PNG})
    assert server.asked[0].body[field] == [message]


# --- what is read ---------------------------------------------------------------------------------------


def candidate(finish: str, *parts: Any, **fields: Any) -> dict[str, Any]:
    return {"candidates": [{"content": {"parts": list(parts)}, "finishReason": finish}], **fields}


def incomplete(reason: str, *output: Any) -> dict[str, Any]:
    return {"status": "incomplete", "incomplete_details": {"reason": reason}, "output": list(output)}


BLOCKED = {"promptFeedback": {"blockReason": "OTHER"}, "usageMetadata": {"promptTokenCount": 9}}
FLAGGED = {"status": "failed", "output": [], "error": {"code": "invalid_prompt", "message": "It was flagged."}}
DECLINED = {"type": "message", "content": [{"type": "refusal", "refusal": "I will not."}]}
HALF = {"type": "message", "content": [{"type": "output_text", "text": "Actions:"}]}
VERDICTS = [
    ("gemini", candidate("MAX_TOKENS", usageMetadata={"thoughtsTokenCount": 9}), ("cut", "", "on its reasoning")),
    ("gemini", candidate("MAX_TOKENS", {"text": "Act"}), ("ok", "Act", "")),
    ("gemini", candidate("STOP", {"text": "hm", "thought": True}, {"text": "a"}, {"text": "b"}), ("ok", "ab", "")),
    ("gemini", candidate("SAFETY"), ("filtered", "", "SAFETY")),
    ("gemini", candidate("PROHIBITED_CONTENT"), ("filtered", "", "PROHIBITED_CONTENT")),
    ("gemini", candidate("MALFORMED_FUNCTION_CALL"), ("empty", "", "MALFORMED_FUNCTION_CALL")),
    ("gemini", BLOCKED, ("filtered", "", "a filter took the prompt: OTHER")),
    ("gemini", {"candidates": [{"finishReason": "STOP"}]}, ("empty", "", "said nothing")),
    ("responses", incomplete("max_output_tokens", {"type": "reasoning"}), ("cut", "", "on its reasoning")),
    ("responses", incomplete("max_output_tokens", HALF), ("ok", "Actions:", "")),
    ("responses", incomplete("content_filter"), ("filtered", "", "content_filter")),
    ("responses", {"status": "completed", "output": [DECLINED]}, ("refused", "I will not.", "declined")),
    ("responses", FLAGGED, ("filtered", "", "It was flagged.")),
]


@pytest.mark.parametrize(("profile", "answer", "expected"), VERDICTS)
async def test_what_became_of_an_answer(profile: str, answer: Any, expected: tuple[str, str, str]) -> None:
    async with Canned(Given(answer)) as server:
        found = await ask(model(server, profile))
    verdict, text, reason = expected
    assert (found.verdict, found.text) == (verdict, text)
    assert reason in found.reason
    assert found.cut == (found.finish in ("MAX_TOKENS", "max_output_tokens"))


USAGES: list[tuple[str, dict[str, Any], tuple[int, int, int, int, int]]] = [
    ("gemini", {"promptTokenCount": 900, "candidatesTokenCount": 40, "thoughtsTokenCount": 60,
                "cachedContentTokenCount": 400, "totalTokenCount": 1000}, (900, 100, 400, 60, 0)),
    ("gemini", {"promptTokenCount": 900, "thoughtsTokenCount": 60}, (900, 60, 0, 60, 0)),
    ("gemini", {"promptTokenCount": 900}, (0, 0, 0, 0, 1)),
    ("responses", {"input_tokens": 900, "input_tokens_details": {"cached_tokens": 400}, "output_tokens": 100,
                   "output_tokens_details": {"reasoning_tokens": 60}}, (900, 100, 400, 60, 0)),
    ("responses", {"input_tokens": 900}, (0, 0, 0, 0, 1)),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "said", "expected"), USAGES)
async def test_tokens_of_caches_and_of_thoughts_are_counted_and_priced(
    profile: str, said: dict[str, Any], expected: tuple[int, int, int, int, int]
) -> None:
    field = "usageMetadata" if profile == "gemini" else "usage"
    async with Canned(Given({**ANSWERS[profile], field: said})) as server:
        client = model(server, profile, prices={"prompt": 1, "completion": 10, "cached": 0.1})
        usage = (await ask(client)).usage
    prompt, written, cached, _, unknown = expected
    found = (usage.prompt_tokens, usage.completion_tokens, usage.cached_tokens, usage.reasoning_tokens)
    assert (*found, usage.unknown_requests) == expected
    if not unknown:
        assert usage.cost_usd == pytest.approx((prompt - cached + 0.1 * cached + 10 * written) * 1e-6)


def gemini_error(status: int, kind: str, message: str, *details: Any) -> Given:
    return Given({"error": {"code": status, "status": kind, "message": message, "details": list(details)}}, status)


WAIT = {"@type": "type.googleapis.com/google.rpc.RetryInfo", "retryDelay": "34.5s"}
NOT_VALID = gemini_error(400, "INVALID_ARGUMENT", "API key not valid. Please pass a valid API key.")
FAULTS: list[tuple[str, Given, type[LLMError], str]] = [
    ("gemini", NOT_VALID, Unauthorized, "is the key right"),
    ("gemini", gemini_error(429, "RESOURCE_EXHAUSTED", "Quota", WAIT), EndpointUnavailable, "Quota"),
    ("gemini", gemini_error(503, "UNAVAILABLE", "The model is overloaded."), EndpointUnavailable, "overloaded"),
    ("gemini", gemini_error(404, "NOT_FOUND", "models/m is not found"), RequestRefused, "models/m is not found"),
    ("gemini", Given({}), MalformedCompletion, "answered with no candidate"),
    ("responses", Given({"status": "failed", "output": [], "error": {"code": "server_error", "message": "Sorry."}}),
     EndpointUnavailable, "Sorry."),
    ("responses", Given({"object": "list"}), MalformedCompletion, "answered with no response"),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "answer", "kind", "words"), FAULTS)
async def test_a_fault_of_an_api_is_this_error(profile: str, answer: Given, kind: type[LLMError], words: str) -> None:
    async with Canned(answer) as server:
        with pytest.raises(kind, match=words) as caught:
            await ask(model(server, profile))
    if isinstance(caught.value, EndpointUnavailable) and "Quota" in words:
        assert caught.value.retry_after_s == 34.5


async def test_a_wrong_key_of_gemini_is_found_before_the_first_request() -> None:
    async with Canned(NOT_VALID) as server:
        client = model(server, "gemini")
        with pytest.raises(Unauthorized):
            await client.check()
        await client.close()
    assert server.asked[0].path == "/v1/models"
