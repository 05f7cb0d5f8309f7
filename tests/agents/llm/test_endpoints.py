"""The HTTP clients against real servers: what is sent, what is read, and what every fault becomes."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import random
import socket
import tracemalloc
import zlib
from typing import TYPE_CHECKING, Any

import pytest
from aiohttp import web
from pydantic import SecretStr

from khala_agents.answers.form import AnswerShape, Tool
from khala_agents.llm.anthropic import Anthropic
from khala_agents.llm.client import (
    Completion,
    EndpointUnavailable,
    LLMError,
    MalformedCompletion,
    OutOfMoney,
    Request,
    RequestRefused,
    TryTimeout,
    Unreachable,
)
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES, Profile
from khala_agents.scripted.canned import Canned, Given
from khala_agents.scripted.endpoint import NONSENSE, Behaviour, Endpoint, count_tokens
from khala_agents.scripted.faults import InjectedFaults
from khala_protocol.messages import ChatMessage, TokenTrace, Usage
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from khala_agents.llm.client import LLMClient

PROMPT = (
    ChatMessage(role="system", content="You are an agent."),
    ChatMessage(role="user", content="Game\n    Time: 0:07\n"),
)
PRICES = Prices(prompt=1.0, completion=10.0, cached=0.1)


def client(base_url: str, **changes: Any) -> OpenAICompatible:
    options: dict[str, Any] = {"model": "silent", "base_url": base_url, "prices": PRICES}
    return OpenAICompatible(PROFILES["scripted"], **(options | changes))


async def ask(model: LLMClient, timeout_s: float = 10.0) -> Completion:
    try:
        return await model.complete(Request(PROMPT, timeout_s=timeout_s))
    finally:
        await model.close()


# --- the scripted endpoint and its faults -------------------------------------------------------------


async def test_a_completion_comes_with_its_usage_and_price() -> None:
    async with Endpoint() as endpoint:
        completion = await ask(client(endpoint.base_url))
    assert completion.text.startswith("Analysis: 0 team(s) of mine")
    prompt = sum(count_tokens(message.content) for message in PROMPT)
    said = count_tokens(completion.text)
    assert (completion.usage.prompt_tokens, completion.usage.completion_tokens) == (prompt, said)
    assert completion.usage.cost_usd == pytest.approx((prompt + 10 * said) / 1e6)


# --- tokens --------------------------------------------------------------------------------------------

TOLD = [
    ({}, {}, None),
    (
        {"logprobs": {"content": [{"token": "Hi", "logprob": -0.5}, {"token": ".", "logprob": -math.inf}]}},
        {},
        TokenTrace(logprobs=(-0.5, -9999.0)),
    ),
    (
        {"logprobs": {"content": [{"token": "token_id:7", "logprob": -1}]}, "token_ids": None},
        {"prompt_token_ids": [1, 2, 3]},
        TokenTrace(prompt_ids=(1, 2, 3), reply_ids=(7,), logprobs=(-1.0,)),
    ),
    ({"token_ids": [4, 5]}, {"prompt_token_ids": ["a", -1]}, TokenTrace(reply_ids=(4, 5))),
    ({"token_ids": 4, "logprobs": {"content": [None]}}, {"prompt_token_ids": {}}, None),
    ({"logprobs": {"content": [{"token": "token_id:" + "9" * 5000, "logprob": "low"}]}}, {}, None),
]


@pytest.mark.parametrize(("choice", "body", "tokens"), TOLD)
async def test_tokens_are_read_as_far_as_an_endpoint_tells_them(choice: Any, body: Any, tokens: TokenTrace) -> None:
    async def answer(request: web.Request) -> web.Response:
        said = {"message": {"role": "assistant", "content": "Hi."}, "finish_reason": "stop"}
        return web.json_response({"choices": [said | choice]} | body)

    application = web.Application()
    application.router.add_post("/v1/chat/completions", answer)
    runner = web.AppRunner(application, shutdown_timeout=0.1)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    try:
        completion = await ask(client(f"http://127.0.0.1:{runner.addresses[0][1]}/v1"))
    finally:
        await runner.cleanup()
    assert (completion.text, completion.tokens) == ("Hi.", tokens)


# --- bodies --------------------------------------------------------------------------------------------


async def _gzip(request: web.Request) -> web.StreamResponse:
    packer = zlib.compressobj(wbits=31)
    packed = [packer.compress(bytes(2**20)) for _ in range(100)]
    return web.Response(
        body=b"".join(packed) + packer.flush(), headers={"Content-Encoding": "gzip"}, content_type="application/json"
    )


async def _endless(request: web.Request) -> web.StreamResponse:
    response = web.StreamResponse()
    await response.prepare(request)
    with contextlib.suppress(ConnectionError):
        while True:
            await response.write(bytes(2**20))
    return response


async def _unknown(request: web.Request) -> web.StreamResponse:
    return web.Response(body=b"{}", headers={"Content-Encoding": "gzip"}, content_type="application/json")


HOSTILE_BODIES = [
    (_gzip, "cannot be used: the answer is larger than 8 MB"),
    (_endless, "cannot be used: the answer is larger than 8 MB"),
    (_unknown, "sent a body that cannot be unpacked"),
]


@pytest.mark.parametrize(("handler", "sentence"), HOSTILE_BODIES, ids=["gzip", "endless", "unknown"])
async def test_no_body_takes_more_than_some_megabytes(handler: Any, sentence: str) -> None:
    application = web.Application()
    application.router.add_post("/v1/chat/completions", handler)
    runner = web.AppRunner(application, shutdown_timeout=0.1)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    try:
        tracemalloc.start()
        with pytest.raises(MalformedCompletion, match=sentence):
            await ask(client(f"http://127.0.0.1:{runner.addresses[0][1]}/v1"))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
        await runner.cleanup()
    assert peak < 40e6


FAULTS = [
    ("429", EndpointUnavailable, "http 429"),
    ("quota", OutOfMoney, "http 429"),
    ("500", EndpointUnavailable, "http 500"),
    ("503", EndpointUnavailable, "http 503"),
    ("529", EndpointUnavailable, "http 529"),
    ("400", RequestRefused, "http 400"),
    ("garbage", MalformedCompletion, "malformed"),
    ("half", Unreachable, "connection"),
    ("reset", Unreachable, "connection"),
    ("drip", TryTimeout, "timeout"),
    ("stall", TryTimeout, "timeout"),
]


@pytest.mark.parametrize(("fault", "kind", "status"), FAULTS, ids=[fault for fault, _, _ in FAULTS])
async def test_a_fault_of_the_endpoint_is_this_error(fault: str, kind: type[LLMError], status: str) -> None:
    async with Endpoint(Behaviour(faults=InjectedFaults({fault: 1.0}), drip_s=0.2)) as endpoint:
        with pytest.raises(LLMError) as caught:
            await ask(client(endpoint.base_url), timeout_s=0.3)
    assert (type(caught.value), caught.value.status) == (kind, status)
    assert "http://127.0.0.1" in str(caught.value), "an error says which endpoint it speaks of"


async def test_nonsense_is_a_completion_like_any_other() -> None:
    async with Endpoint(Behaviour(faults=InjectedFaults({"nonsense": 1.0}))) as endpoint:
        assert (await ask(client(endpoint.base_url))).text == NONSENSE


@pytest.mark.parametrize(("status", "asked_s"), [("429", 7.5), ("503", 7.5), ("500", None)])
async def test_retry_after_reaches_the_error(status: str, asked_s: float | None) -> None:
    async with Endpoint(Behaviour(faults=InjectedFaults({status: 1.0}), retry_after_s=7.5)) as endpoint:
        with pytest.raises(EndpointUnavailable) as caught:
            await ask(client(endpoint.base_url))
    assert caught.value.retry_after_s == asked_s


async def test_nobody_at_the_address_is_unreachable() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # and not listening
        port = taken.getsockname()[1]
        with pytest.raises(Unreachable, match=f"http://127.0.0.1:{port}/v1 cannot be reached"):
            await ask(client(f"http://127.0.0.1:{port}/v1"))


async def test_an_unknown_model_is_refused_with_the_words_of_the_endpoint() -> None:
    async with Endpoint() as endpoint:
        with pytest.raises(RequestRefused, match=r"http 404: there is no model 'gpt', there are silent, random-legal"):
            await ask(client(endpoint.base_url, model="gpt"))


async def test_calls_that_are_cancelled_at_any_moment_never_spoil_later_ones() -> None:
    rng = random.Random(5)
    async with Endpoint(Behaviour(latency_s=0.02)) as endpoint:
        models = [client(endpoint.base_url) for _ in range(8)]

        async def hurried(model: OpenAICompatible) -> None:
            for _ in range(50):
                try:
                    async with asyncio.timeout(rng.uniform(0.0, 0.03)):
                        await model.complete(Request(PROMPT))
                except TimeoutError:
                    continue

        await asyncio.gather(*(hurried(model) for model in models))
        later = await asyncio.gather(*(model.complete(Request(PROMPT, timeout_s=5.0)) for model in models))
        assert len(later) == 8
        await asyncio.gather(*(model.refresh() for model in models))
        again = await asyncio.gather(*(model.complete(Request(PROMPT, timeout_s=5.0)) for model in models))
        assert len(again) == 8
        await asyncio.gather(*(model.close() for model in models))


async def test_a_refreshed_client_makes_its_first_request_on_a_connection_that_is_there() -> None:
    async with Recorder() as server:
        model = client(server.base_url)
        await model.refresh()
        for _ in range(2):
            await model.complete(Request(PROMPT, timeout_s=5.0))
        await model.close()
    assert [path for path, _, _ in server.requests] == ["/v1/models", "/v1/chat/completions", "/v1/chat/completions"]
    assert len(server.peers) == 1


async def test_refreshing_raises_nothing_when_nobody_is_there() -> None:
    model = client("http://127.0.0.1:9/v1")
    await model.refresh()
    await model.close()
    await model.close()


# --- what is sent and read ----------------------------------------------------------------------------


class Recorder(Canned):
    """A server that records its requests, and sends the given answer."""

    def __init__(self, answer: Any = None, status: int = 200) -> None:
        super().__init__(Given(GOOD if answer is None else answer, status))

    @property
    def requests(self) -> list[tuple[str, dict[str, str], Any]]:
        return [(asked.path, dict(asked.headers), asked.body) for asked in self.asked]

    @property
    def peers(self) -> set[Any]:
        return {asked.peer for asked in self.asked}


GOOD: Any = {
    "choices": [{"message": {"role": "assistant", "content": "Analysis: go."}, "finish_reason": "stop"}],
    "usage": {"prompt_tokens": 1000, "completion_tokens": 100},
}

SENT = [
    (PROFILES["openai"], {"max_completion_tokens": 50, "temperature": 0.5, "seed": 3}, "system"),
    (PROFILES["openai-reasoning"], {"max_completion_tokens": 50, "seed": 3}, "developer"),
    (PROFILES["deepseek"], {"max_tokens": 50, "temperature": 0.5}, "system"),
    (PROFILES["vllm"], {"max_tokens": 50, "temperature": 0.5, "seed": 3}, "system"),
    (Profile(system_role="user"), {"max_tokens": 50, "temperature": 0.5, "seed": 3}, "user"),
]


@pytest.mark.parametrize(("profile", "params", "role"), SENT)
async def test_a_request_is_sent_as_the_profile_says(profile: Profile, params: dict[str, Any], role: str) -> None:
    async with Recorder() as server:
        model = OpenAICompatible(
            profile,
            model="m",
            base_url=server.base_url + "/",
            prices=PRICES,
            key=SecretStr("sk-test-0123456789"),
            max_tokens=50,
            temperature=0.5,
            seed=3,
            extra={"thinking": {"type": "disabled"}, "top_p": 0.9},
        )
        await ask(model)
    ((path, headers, body),) = server.requests
    assert (path, headers["authorization"]) == ("/v1/chat/completions", "Bearer sk-test-0123456789")
    assert body == {
        "model": "m",
        **params,
        "thinking": {"type": "disabled"},
        "top_p": 0.9,
        "messages": [
            {"role": role, "content": PROMPT[0].content},
            {"role": "user", "content": PROMPT[1].content},
        ],
    }
    assert model.params == {**params, "thinking.type": "disabled", "top_p": 0.9}, "what is recorded"


SCHEMA = {"type": "object", "properties": {"n": {"type": "array", "items": {"type": "number", "minimum": 0}}}}
STOP = Tool("Stop", "Stand still.", {"type": "object", "properties": {}})
NAMED = {"name": "answer", "strict": True, "schema": SCHEMA}
FUNCTION = {"name": "Stop", "description": "Stand still.", "parameters": STOP.parameters}
SHAPES: list[tuple[Any, AnswerShape, dict[str, Any]]] = [
    ("openai", AnswerShape(schema=SCHEMA), {"response_format": {"type": "json_schema", "json_schema": NAMED}}),
    ("openai", AnswerShape(tools=(STOP,)), {"tools": [{"type": "function", "function": FUNCTION}]}),
    ("llamacpp", AnswerShape(grammar="root ::= x"), {"grammar": "root ::= x"}),
    ("vllm", AnswerShape(grammar="root ::= x"), {"structured_outputs": {"grammar": "root ::= x"}}),
]


@pytest.mark.parametrize(("profile", "shape", "fields"), SHAPES)
async def test_the_form_of_an_answer_is_asked_for_as_the_endpoint_wants_it(
    profile: Any, shape: AnswerShape, fields: dict[str, Any]
) -> None:
    async with Recorder() as server:
        model = OpenAICompatible(PROFILES[profile], model="m", base_url=server.base_url, prices=PRICES)
        await model.complete(Request(PROMPT, timeout_s=10, shape=shape))
        await model.close()
    ((_, _, body),) = server.requests
    assert {name: value for name, value in body.items() if name not in ("model", "messages")} == fields


async def test_anthropic_gets_schemas_without_limits_and_tools_in_its_form() -> None:
    answer = {"content": [{"type": "tool_use", "name": "Stop", "input": {"team": "A"}}], "stop_reason": "tool_use"}
    async with Recorder(answer) as server:
        model = Anthropic(model="m", base_url=server.base_url, prices=PRICES)
        await model.complete(Request(PROMPT, timeout_s=10, shape=AnswerShape(schema=SCHEMA)))
        completion = await model.complete(Request(PROMPT, timeout_s=10, shape=AnswerShape(tools=(STOP,))))
        await model.close()
    (_, _, by_schema), (_, _, by_tools) = server.requests
    assert "minimum" not in json.dumps(by_schema["output_config"])
    assert by_tools["tools"] == [{"name": "Stop", "description": "Stand still.", "input_schema": STOP.parameters}]
    assert parse(completion.text).calls[0].team == "A"
    assert completion.reason == "", "the tools were offered"


async def test_a_form_that_an_endpoint_refuses_is_left_out() -> None:
    refusal = {"error": {"message": "Unsupported parameter: 'response_format'"}}
    async with Recorder(refusal, 400) as server:
        model = OpenAICompatible(PROFILES["openai"], model="no schemas", base_url=server.base_url, prices=PRICES)
        with pytest.raises(RequestRefused):
            await model.complete(Request(PROMPT, timeout_s=10, shape=AnswerShape(schema=SCHEMA)))
        await model.close()
    assert ["response_format" in body for _, _, body in server.requests] == [True, False]


async def test_no_key_sends_no_authorization() -> None:
    async with Recorder() as server:
        await ask(client(server.base_url))
    assert "authorization" not in server.requests[0][1]


def with_message(**message: Any) -> dict[str, Any]:
    return {"choices": [{"message": {"role": "assistant", **message}}]}


TEXTS = [
    (with_message(content="text"), "text"),
    (with_message(content=[{"type": "text", "text": "a"}, {"type": "image"}, {"type": "text", "text": "b"}]), "ab"),
    (with_message(content="said", reasoning_content="thought"), "said"),
    (with_message(content=None, refusal="I will not."), "I will not."),
    (with_message(content=None), ""),
    (with_message(), ""),
]


@pytest.mark.parametrize(("answer", "text"), TEXTS)
async def test_the_words_are_found_in_every_form_of_an_answer(answer: Any, text: str) -> None:
    async with Recorder(answer) as server:
        completion = await ask(client(server.base_url))
    assert completion.text == text
    assert completion.usage == Usage(requests=1, unknown_requests=1), "an answer without usage is unknown, not free"


USAGES = [
    ("openai", {"prompt_tokens": 1000, "completion_tokens": 100}, (1000, 100, 0, 0, 0.002)),
    (
        "openai",
        {
            "prompt_tokens": 1000,
            "completion_tokens": 100,
            "prompt_tokens_details": {"cached_tokens": 400},
            "completion_tokens_details": {"reasoning_tokens": 60},
        },
        (1000, 100, 400, 60, 0.00164),
    ),
    (
        "deepseek",
        {"prompt_tokens": 1000, "completion_tokens": 100, "prompt_cache_hit_tokens": 1000},
        (1000, 100, 1000, 0, 0.0011),
    ),
    ("openai", {"prompt_tokens": 10, "completion_tokens": 1, "prompt_tokens_details": None}, (10, 1, 0, 0, 0.00002)),
]


@pytest.mark.parametrize(("profile", "said", "expected"), USAGES)
async def test_usage_is_read_where_the_endpoint_puts_it(profile: Any, said: Any, expected: tuple[Any, ...]) -> None:
    async with Recorder({**GOOD, "usage": said}) as server:
        model = OpenAICompatible(PROFILES[profile], model="m", base_url=server.base_url, prices=PRICES)
        usage = (await ask(model)).usage
    found = (usage.prompt_tokens, usage.completion_tokens, usage.cached_tokens, usage.reasoning_tokens)
    assert found == expected[:4]
    assert usage.cost_usd == pytest.approx(expected[4])


BAD_ANSWERS = [
    (b"", MalformedCompletion, "answered with no chat completion: ''"),
    (b"<html>", MalformedCompletion, "answered with no chat completion: '<html>'"),
    ({"choices": []}, MalformedCompletion, "answered with no chat completion"),
    ({"choices": [{"message": {"content": 3}}]}, MalformedCompletion, "answered with no chat completion"),
    ({"error": {"code": 503, "message": "no capacity"}}, EndpointUnavailable, "answered http 503: no capacity"),
    ({"error": {"code": 402, "message": "no credits"}}, OutOfMoney, "answered http 402: no credits"),
]


@pytest.mark.parametrize(("answer", "kind", "words"), BAD_ANSWERS)
async def test_an_ok_that_holds_no_completion_is_an_error(answer: Any, kind: type[LLMError], words: str) -> None:
    async with Recorder(answer) as server:
        with pytest.raises(kind) as caught:
            await ask(client(server.base_url))
    assert words in str(caught.value)


REFUSALS = [
    (400, {"error": {"message": "bad\n  temperature", "code": "x"}}, "answered http 400: bad temperature"),
    (401, {"error": "no"}, "answered http 401: no; is the key right, and may it use this model?"),
    (402, b"", "answered http 402; the account has no money or quota left"),
    (418, b"I am a teapot" + b"!" * 300, "answered http 418: I am a teapot" + "!" * 186 + "…"),
    (500, {"detail": "?"}, 'answered http 500: {"detail":"?"}'),
]


@pytest.mark.parametrize(("status", "answer", "words"), REFUSALS)
async def test_an_error_quotes_what_the_endpoint_said_on_one_line(status: int, answer: Any, words: str) -> None:
    async with Recorder(answer, status) as server:
        with pytest.raises(LLMError) as caught:
            await ask(client(server.base_url))
        assert str(caught.value) == f"{server.base_url}/chat/completions {words}"


# --- Anthropic ----------------------------------------------------------------------------------------


async def test_anthropic_is_spoken_to_in_its_own_words() -> None:
    answer = {
        "content": [
            {"type": "thinking", "thinking": "hm"},
            {"type": "text", "text": "Analysis: "},
            {"type": "text", "text": "go."},
        ],
        "stop_reason": "end_turn",
        "usage": {"input_tokens": 600, "output_tokens": 100, "cache_read_input_tokens": 400},
    }
    async with Recorder(answer) as server:
        model = Anthropic(
            model="claude", prices=PRICES, key=SecretStr("sk-ant-0123"), base_url=server.base_url, temperature=0.1
        )
        completion = await ask(model)
    ((path, headers, body),) = server.requests
    assert (path, headers["x-api-key"], headers["anthropic-version"]) == ("/v1/messages", "sk-ant-0123", "2023-06-01")
    assert "authorization" not in headers
    assert body == {
        "model": "claude",
        "max_tokens": 1024,
        "temperature": 0.1,
        "system": PROMPT[0].content,
        "messages": [{"role": "user", "content": PROMPT[1].content}],
    }
    assert (completion.text, completion.finish) == ("Analysis: go.", "end_turn")
    usage = completion.usage
    assert (usage.prompt_tokens, usage.completion_tokens, usage.cached_tokens) == (1000, 100, 400)
    assert usage.cost_usd == pytest.approx(0.00164)


@pytest.mark.parametrize(
    ("usage", "tokens"),
    [
        ({"prompt_tokens": 900, "completion_tokens": 60}, (900, 60, 0)),
        ({"prompt_tokens": 900, "completion_tokens": 60, "total_tokens": 2160}, (900, 1260, 0)),  # reasoning apart
        ({"prompt_tokens": 0, "completion_tokens": 0}, (0, 0, 1)),
        ({"prompt_tokens": 900, "completion_tokens": 0}, (0, 0, 1)),
        ({"prompt_tokens": -900, "completion_tokens": 60}, (0, 0, 1)),
        ({"prompt_tokens": "many", "completion_tokens": 60}, (0, 0, 1)),
    ],
)
async def test_usage_that_cannot_be_is_unknown_and_reasoning_that_is_counted_apart_is_priced(
    usage: dict[str, Any], tokens: tuple[int, int, int]
) -> None:
    async with Canned(Given({"choices": [{"message": {"content": "go"}}], "usage": usage})) as server:
        found = (await ask(client(server.base_url))).usage
    assert (found.prompt_tokens, found.completion_tokens, found.unknown_requests) == tokens


async def test_the_front_of_a_prompt_is_marked_for_anthropic_and_its_cache_is_counted_and_priced() -> None:
    answer = {
        "content": [{"type": "text", "text": "go"}],
        "usage": {"input_tokens": 100, "output_tokens": 10, "cache_creation_input_tokens": 900},
    }
    prompt = (*PROMPT, ChatMessage(role="assistant", content="example"), ChatMessage(role="user", content="now"))
    async with Recorder(answer) as server:
        prices = Prices(prompt=1.0, completion=10.0, cache_write=1.25)
        model = Anthropic(model="claude", prices=prices, key=SecretStr("sk-ant-0123"), base_url=server.base_url)
        usage = (await model.complete(Request(prompt, stable=3))).usage
        await model.close()
    ((_, _, body),) = server.requests
    mark = {"type": "ephemeral"}
    assert body["system"] == [{"type": "text", "text": "You are an agent.", "cache_control": mark}]
    _, example, now = body["messages"]
    assert example["content"] == [{"type": "text", "text": "example", "cache_control": mark}]
    assert now == {"role": "user", "content": "now"}
    assert (usage.prompt_tokens, usage.cache_write_tokens) == (1000, 900)
    assert usage.cost_usd == pytest.approx((100 + 900 * 1.25 + 10 * 10) * 1e-6)


ANTHROPIC_FAULTS = [
    (529, {"type": "error", "error": {"type": "overloaded_error", "message": "Overloaded"}}, EndpointUnavailable),
    (429, {"type": "error", "error": {"type": "enforced_spend_limit_reached", "message": "Spent"}}, OutOfMoney),
    (400, {"type": "error", "error": {"type": "invalid_request_error", "message": "max_tokens"}}, RequestRefused),
    (200, {"type": "message"}, MalformedCompletion),
]


@pytest.mark.parametrize(("status", "answer", "kind"), ANTHROPIC_FAULTS)
async def test_a_fault_of_anthropic_is_this_error(status: int, answer: Any, kind: type[LLMError]) -> None:
    async with Recorder(answer, status) as server:
        with pytest.raises(kind):
            await ask(Anthropic(model="claude", prices=PRICES, key=SecretStr("sk-ant-0123"), base_url=server.base_url))
