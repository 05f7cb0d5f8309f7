"""Requests in batches: sent at once, answered each on its own, at half the price, and cancelled if no call waits."""

from __future__ import annotations

import asyncio
import json
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.answers.form import AnswerShape
from khala_agents.batch_policy import BatchPolicy
from khala_agents.build import Workshop, client_for
from khala_agents.config import ModelConfig, WorkerSpec
from khala_agents.llm import asking, batches
from khala_agents.llm.batches import Batcher
from khala_agents.llm.client import Completion, Departure, EndpointUnavailable, LLMError, Request, RequestRefused
from khala_agents.llm.money import SharedBudget
from khala_agents.llm_policy import LLMPolicy
from khala_agents.policy import Context
from khala_agents.scripted.canned import Canned, CannedRequest, Given, completion, refusal
from khala_protocol.errors import ConfigError
from khala_protocol.messages import ChatMessage, Clock
from khala_sc2.playing.minds import Minds

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_agents.llm.client import LLMClient
    from khala_protocol.messages import Briefing, Observation

USAGE = {"prompt_tokens": 100, "completion_tokens": 10}


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have batches leave after a moment, and be looked at soon."""
    monkeypatch.setattr(asking, "Batcher", partial(Batcher, quiet_s=0.05, look_s=0.01))
    monkeypatch.setenv("API_KEY", "sk-0123456789")


class OpenAI:
    """Batches as OpenAI has them: a batch is answered when it is looked at for the second time."""

    def __init__(self, reply: Callable[[Any], dict[str, Any]], end: str = "completed") -> None:
        self.reply = reply
        self.end = end
        self.files: list[list[Any]] = []
        self.looks = 0
        self.cancelled: list[str] = []

    def __call__(self, asked: CannedRequest) -> Given:
        match asked.path.removeprefix("/v1/").split("/"):
            case ["files"]:
                form = asked.body.decode()
                assert 'name="purpose"\r\n\r\nbatch\r\n' in form
                self.files.append([json.loads(line) for line in form.splitlines() if line.startswith("{")])
                return Given({"id": f"file-{len(self.files)}"})
            case ["batches"]:
                assert asked.body["completion_window"] == "24h"
                assert asked.body["endpoint"] == self.files[-1][0]["url"]
                return Given({"id": asked.body["input_file_id"].replace("file", "batch"), "status": "validating"})
            case ["batches", name, "cancel"]:
                self.cancelled.append(name)
                return Given({"id": name, "status": "cancelling"})
            case ["batches", name]:
                self.looks += 1
                ended = {"status": self.end, "output_file_id": name.replace("batch", "out"), "error_file_id": None}
                return Given({"id": name, **(ended if self.looks % 2 == 0 else {"status": "in_progress"})})
            case ["files", name, "content"]:
                requests = reversed(self.files[int(name.removeprefix("out-")) - 1])  # in any order
                lines = [{"custom_id": request["custom_id"], **self.reply(request["body"])} for request in requests]
                return Given("\n".join(map(json.dumps, lines)).encode())
        raise AssertionError(asked.path)


def good(body: Any) -> dict[str, Any]:
    """Answer with the last words of a request."""
    words = body["messages"][-1]["content"]
    return {"response": {"status_code": 200, "body": completion(f"{words}!", usage=USAGE).body}, "error": None}


class Claude:
    """Batches as Anthropic has them."""

    def __init__(self, *results: Callable[[str], dict[str, Any]]) -> None:
        self.results = results
        self.requests: list[Any] = []

    def __call__(self, asked: CannedRequest) -> Given:
        match asked.path.removeprefix("/v1/messages/").split("/"):
            case ["batches"]:
                self.requests = asked.body["requests"]
                return Given({"id": "msgbatch_1", "processing_status": "in_progress"})
            case ["batches", "msgbatch_1"]:
                return Given({"id": "msgbatch_1", "processing_status": "ended"})
            case ["batches", "msgbatch_1", "results"]:
                lines = [
                    {"custom_id": request["custom_id"], "result": result(request["params"]["messages"][-1]["content"])}
                    for request, result in zip(self.requests, self.results, strict=True)
                ]
                return Given("\n".join(map(json.dumps, lines)).encode())
        raise AssertionError(asked.path)


def client(server: Canned, profile: str = "openai", **fields: Any) -> LLMClient:
    config = {"profile": profile, "model": "m", "base_url": server.base_url, "api_key_env": "API_KEY", "batch": True}
    return client_for(ModelConfig.model_validate(config | fields))


async def ask(model: LLMClient, words: str, **changes: Any) -> Completion:
    return await model.complete(Request((ChatMessage(role="user", content=words),), timeout_s=20, **changes))


async def test_requests_of_all_agents_are_sent_in_one_batch_and_each_gets_its_answer() -> None:
    endpoint = OpenAI(good)
    async with Canned(endpoint) as server:
        models = [client(server, max_tokens=9) for _ in range(3)]
        answers = await asyncio.gather(*(ask(model, words) for model, words in zip(models, "abc", strict=True)))
        again = await ask(models[0], "d")
        for model in models:
            await model.close()
    assert [answer.text for answer in (*answers, again)] == ["a!", "b!", "c!", "d!"]
    assert answers[0].usage.prompt_tokens == 100
    first, second = endpoint.files
    assert [request["body"]["messages"][0]["content"] for request in first] == ["a", "b", "c"]
    assert second == [
        {
            "custom_id": "request-0",
            "method": "POST",
            "url": "/v1/chat/completions",
            "body": {"model": "m", "max_completion_tokens": 9, "messages": [{"role": "user", "content": "d"}]},
        }
    ]
    assert endpoint.cancelled == []


async def test_the_results_of_claude_are_answers_errors_and_requests_that_came_to_nothing() -> None:
    def said(words: str) -> dict[str, Any]:
        usage = {"input_tokens": 100, "output_tokens": 10}
        return {"type": "succeeded", "message": {"content": [{"type": "text", "text": f"{words}!"}], "usage": usage}}

    def wrong(_: str) -> dict[str, Any]:
        fault = {"type": "invalid_request_error", "message": "max_tokens: too large"}
        return {"type": "errored", "error": {"type": "error", "error": fault}}

    endpoint = Claude(said, wrong, lambda _: {"type": "expired"})
    async with Canned(endpoint) as server:
        model = client(server, "anthropic")
        told = [ask(model, words) for words in "abc"]
        good_one, refused, expired = await asyncio.gather(*told, return_exceptions=True)
        await model.close()
    assert isinstance(good_one, Completion)
    assert (good_one.text, good_one.usage.completion_tokens) == ("a!", 10)
    assert isinstance(refused, RequestRefused)
    assert "too large" in str(refused)
    assert isinstance(expired, EndpointUnavailable)
    assert not expired.may_be_billed
    assert endpoint.requests[0] == {
        "custom_id": "request-0",
        "params": {"model": "m", "max_tokens": 1024, "messages": [{"role": "user", "content": "a"}]},
    }


UNSUPPORTED = "Unsupported parameter: '{}' is not supported with this model."
REFUSED = [
    ("temperature", UNSUPPORTED.format("temperature")),
    ("max_completion_tokens", UNSUPPORTED.format("max_completion_tokens")),
    ("response_format", UNSUPPORTED.format("response_format")),
    ("maxLength", "Invalid schema for response_format 'answer': 'maxLength' is not permitted."),
]


@pytest.mark.parametrize(("field", "words"), REFUSED)
async def test_clients_whose_requests_are_refused_at_once_all_ask_again(field: str, words: str) -> None:
    def reply(body: Any) -> dict[str, Any]:
        refused = {"response": {"status_code": 400, "body": refusal(400, words).body}}
        return refused if field in json.dumps(body) else good(body)

    endpoint = OpenAI(reply)
    shape = AnswerShape(schema={"type": "object", "properties": {"say": {"type": "string", "maxLength": 9}}})
    async with Canned(endpoint) as server:
        models = [client(server, temperature=0.5, max_tokens=9) for _ in range(2)]
        answers = await asyncio.gather(*(ask(model, "a", shape=shape) for model in models))
        for model in models:
            await model.close()
    assert [answer.text for answer in answers] == ["a!", "a!"]
    assert [[field in json.dumps(request) for request in requests] for requests in endpoint.files] == [
        [True, True],
        [False, False],
    ]


async def test_a_full_batch_leaves_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(asking, "Batcher", partial(Batcher, quiet_s=3600, look_s=0.01))
    monkeypatch.setattr(batches, "FULL", 2)
    endpoint = OpenAI(good)
    async with Canned(endpoint) as server:
        model = client(server)
        await asyncio.gather(ask(model, "a"), ask(model, "b"))
        await model.close()
    assert [len(requests) for requests in endpoint.files] == [2]


async def test_a_batch_is_cancelled_when_the_last_call_has_left_it() -> None:
    endpoint = OpenAI(good)
    sent = asyncio.Event()

    def answer(asked: CannedRequest) -> Given:
        if asked.path == "/v1/batches":
            sent.set()
        given = endpoint(asked)
        endpoint.looks = 0  # it is never answered
        return given

    async with Canned(answer) as server:
        models = [client(server), client(server)]
        deliveries = [Departure(), Departure()]
        calls = [
            asyncio.create_task(ask(model, "a", delivery=delivery))
            for model, delivery in zip(models, deliveries, strict=True)
        ]
        await sent.wait()
        assert all(delivery.left for delivery in deliveries), "an answer may be billed from now on"
        calls[0].cancel()
        await asyncio.wait({calls[0]})
        await models[0].close()
        assert endpoint.cancelled == []
        calls[1].cancel()
        await asyncio.wait({calls[1]})
        await models[1].close()
    assert endpoint.cancelled == ["batch-1"]


async def test_a_call_that_leaves_before_its_batch_costs_nothing() -> None:
    endpoint = OpenAI(good)
    async with Canned(endpoint) as server:
        model = client(server)
        delivery = Departure()
        call = asyncio.create_task(ask(model, "a", delivery=delivery))
        other = asyncio.create_task(ask(model, "b"))
        await asyncio.sleep(0)  # both wait for their batch
        call.cancel()
        assert (await other).text == "b!"
        await model.close()
    assert not delivery.left
    assert [len(requests) for requests in endpoint.files] == [1]


FAULTS: list[tuple[Any, str]] = [
    (lambda _: refusal(429, "Enqueued token limit reached"), "Enqueued token limit reached"),
    (lambda _: Given({}), "does not say its name"),
    (lambda _: Given(b"<html>"), "no object of JSON"),
    (OpenAI(good, end="failed"), "the batch batch-1 failed"),
    (OpenAI(lambda _: {"response": None, "error": {"code": "batch_expired", "message": "Too late."}}), "Too late."),
]


@pytest.mark.parametrize(("endpoint", "words"), FAULTS)
async def test_a_batch_that_fails_is_an_error_of_each_of_its_calls(endpoint: Any, words: str) -> None:
    async with Canned(endpoint) as server:
        model = client(server)
        errors = await asyncio.gather(ask(model, "a"), ask(model, "b"), return_exceptions=True)
        await model.close()
    first, second = errors
    assert first is not second
    for error in errors:
        assert isinstance(error, LLMError)
        assert words in str(error)
        assert error.retryable


async def test_an_endpoint_that_is_away_for_a_moment_is_looked_at_again() -> None:
    endpoint = OpenAI(good)
    away = iter([refusal(503, "later")])

    def answer(asked: CannedRequest) -> Given:
        return next(away, None) or endpoint(asked) if asked.path == "/v1/batches/batch-1" else endpoint(asked)

    async with Canned(answer) as server:
        model = client(server)
        assert (await ask(model, "a")).text == "a!"
        await model.close()


FILE = """
profile: {profile}
model: m
base_url: {base}
api_key_env: API_KEY
batch: true
max_tokens: 10
prices: {{prompt: 2, completion: 20}}
"""


@pytest.mark.parametrize(("cap_usd", "status"), [(0.01, "ok"), (0.0001, "failed")])
async def test_half_the_price_is_reserved_and_paid(
    tmp_path: Path,
    cap_usd: float,
    status: str,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    async with Canned(OpenAI(good)) as server:
        file = tmp_path / "batch.yaml"
        file.write_text(FILE.format(profile="openai", base=server.base_url))
        budget = SharedBudget(cap_usd)
        policy = Workshop(budget=budget).policy(WorkerSpec(model=str(file)))
        assert isinstance(policy, LLMPolicy)
        context = Context(briefing(clock=Clock(max_wait_s=7200)), observation(within_s=7200.0))
        if status == "ok":
            await policy.decide(context)
            assert budget.booked_usd == pytest.approx((100 * 1 + 10 * 10) * 1e-6)
        else:
            with pytest.raises(LLMError, match="the budget"):
                await policy.decide(context)
        await policy.close()


CLOCKS = [
    (Clock(rule="realtime"), "in real time the game goes on while a batch is answered; play with --clock frozen"),
    (Clock(max_wait_s=15), "a step waits 15 s, and a batch takes up to a day; play with --max-wait 86400"),
]


@pytest.mark.parametrize(("clock", "words"), CLOCKS)
async def test_a_match_that_does_not_wait_is_refused_before_it_begins_or_in_its_first_step(
    clock: Clock,
    words: str,
    tmp_path: Path,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    async with Canned(OpenAI(good)) as server:
        policy = BatchPolicy(client(server))
        with pytest.raises(RequestRefused) as caught:
            await policy.decide(Context(briefing(clock=clock), observation()))
        await policy.close()
    sentence = f"a model file with `batch: true` is for matches that wait: {words}"
    assert str(caught.value) == sentence
    assert caught.value.hopeless
    assert server.asked == []
    file = tmp_path / "batch.yaml"
    file.write_text(FILE.format(profile="anthropic", base="http://127.0.0.1:1/v1"))
    minds = Minds(model=str(file))
    with pytest.raises(ConfigError) as before:
        minds.check(clock)
    assert str(before.value) == f"{file}: {sentence}"
    minds.check(Clock(max_wait_s=86400))
