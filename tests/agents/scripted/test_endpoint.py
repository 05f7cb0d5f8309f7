"""The scripted endpoint over HTTP, and its faults."""

from __future__ import annotations

import asyncio
import hashlib
import re
from typing import TYPE_CHECKING, Any

import aiohttp
import pytest

from khala_agents.scripted.endpoint import Behaviour, Endpoint, count_tokens
from khala_agents.scripted.faults import InjectedFaults, parse_faults
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

USER = {"role": "user", "content": "Game\n"}


@pytest.fixture
async def http() -> AsyncIterator[aiohttp.ClientSession]:
    async with aiohttp.ClientSession() as session:
        yield session


async def complete(http: aiohttp.ClientSession, endpoint: Endpoint, **body: Any) -> tuple[int, Any]:
    async with http.post(f"{endpoint.base_url}/chat/completions", json=body) as response:
        return response.status, await response.json()


async def test_it_speaks_chat_completions(http: aiohttp.ClientSession) -> None:
    async with Endpoint() as endpoint:
        status, body = await complete(http, endpoint, model="silent", messages=[USER], temperature=1, unknown=2)
    assert status == 200
    assert (body["object"], body["model"]) == ("chat.completion", "silent")
    assert re.fullmatch(r"chatcmpl-[0-9a-f]{24}", body["id"])
    (choice,) = body["choices"]
    text = "Analysis: 0 team(s) of mine, 0 enemy unit(s) in sight. I watch.\n"
    assert choice == {"index": 0, "message": {"role": "assistant", "content": text}, "finish_reason": "stop"}
    assert body["usage"] == {"prompt_tokens": 2, "completion_tokens": 16, "total_tokens": 18}


async def test_it_says_what_it_has_and_that_it_is_well(http: aiohttp.ClientSession) -> None:
    async with Endpoint() as endpoint:
        async with http.get(f"{endpoint.base_url}/models") as response:
            names = [model["id"] for model in (await response.json())["data"]]
        async with http.get(endpoint.base_url.removesuffix("/v1") + "/health") as response:
            health = await response.json()
    assert (names, health) == (["silent", "random-legal", "focus-fire", "skilled"], {"status": "ok"})


BAD_REQUESTS = [
    ({"model": "gpt-4o", "messages": [USER]}, 404, "model_not_found"),
    ({"messages": [USER]}, 400, "invalid_request"),
    ({"model": "silent", "messages": "hello"}, 400, "invalid_request"),
    ({"model": "silent", "messages": [{"role": "wizard", "content": ""}]}, 400, "invalid_request"),
]


@pytest.mark.parametrize(("body", "status", "code"), BAD_REQUESTS)
async def test_a_request_that_is_none_is_refused(
    http: aiohttp.ClientSession, body: dict[str, Any], status: int, code: str
) -> None:
    async with Endpoint() as endpoint:
        found, answer = await complete(http, endpoint, **body)
    assert (found, answer["error"]["code"]) == (status, code)


async def test_contents_in_parts_are_joined_and_pictures_passed_over(http: aiohttp.ClientSession) -> None:
    parts = [
        {"type": "text", "text": "Team A\n    Your units:\n"},
        {"type": "image_url", "image_url": {"url": "data:"}},
        {"type": "text", "text": "        Stalker | tag 0x1 | screen [1, 1] | health 1/1\n"},
    ]
    async with Endpoint() as endpoint:
        _, body = await complete(http, endpoint, model="silent", messages=[{"role": "user", "content": parts}])
    assert body["choices"][0]["message"]["content"].startswith("Analysis: 1 team(s)")


async def test_latency_is_kept_for_many_requests_at_once(http: aiohttp.ClientSession) -> None:
    clock = asyncio.get_running_loop().time
    async with Endpoint(Behaviour(latency_s=0.2)) as endpoint:
        began = clock()
        asked = (complete(http, endpoint, model="focus-fire", messages=[USER]) for _ in range(20))
        answers = await asyncio.gather(*asked)
        took = clock() - began
    assert {status for status, _ in answers} == {200}
    assert 0.2 <= took < 1.0, "one after the other they would take 4 s"


async def test_an_address_in_use_is_one_clear_sentence() -> None:
    async with Endpoint() as first:
        port = int(first.base_url.split(":")[2].split("/")[0])
        with pytest.raises(ConfigError) as caught:
            async with Endpoint(port=port):
                pass
    assert f"cannot listen on 127.0.0.1:{port}: " in str(caught.value)
    assert str(caught.value).endswith("--port names another port")


@pytest.mark.parametrize(("text", "tokens"), [("", 0), ("a", 1), ("four", 1), ("fives", 2), ("ünïç", 1)])
def test_tokens_are_counted_by_the_rule(text: str, tokens: int) -> None:
    assert count_tokens(text) == tokens


# --- faults -------------------------------------------------------------------------------------------


def prompts(count: int) -> list[str]:
    return [hashlib.sha256(str(number).encode()).hexdigest() for number in range(count)]


def test_faults_come_at_their_rates() -> None:
    faults = InjectedFaults({"429": 0.2, "stall": 0.05})
    picked = [faults.pick(prompt) for prompt in prompts(4000)]
    assert picked.count("429") / 4000 == pytest.approx(0.2, abs=0.02)
    assert picked.count("stall") / 4000 == pytest.approx(0.05, abs=0.01)
    assert picked.count(None) / 4000 == pytest.approx(0.75, abs=0.02)


def test_the_same_seed_hits_the_same_requests_in_whatever_order_they_come() -> None:
    def hit(order: list[str], seed: int) -> dict[str, str | None]:
        faults = InjectedFaults({"500": 0.3}, seed=seed)
        return {prompt: faults.pick(prompt) for prompt in order}

    asked = prompts(100)
    assert hit(asked, 1) == hit(asked[::-1], 1)
    assert hit(asked, 1) != hit(asked, 2)


def test_a_repeated_request_may_fare_better() -> None:
    faults = InjectedFaults({"500": 0.5})
    assert {faults.pick("prompt") for _ in range(20)} == {None, "500"}


def test_options_become_rates() -> None:
    assert parse_faults(["429=0.1", "stall=0.01", "garbage=1e-3"]) == {"429": 0.1, "stall": 0.01, "garbage": 0.001}


KNOWN = "use an HTTP status from 400 to 599 or one of quota, garbage, nonsense, half, reset, drip, stall"
BAD_FAULTS = [
    (["fire=1"], f"--fault: 'fire' is not a fault: {KNOWN}, such as --fault 429=0.1"),
    (["200=1"], f"--fault: '200' is not a fault: {KNOWN}, such as --fault 429=0.1"),
    (["429"], "--fault: '429' needs a rate between 0 and 1, such as 429=0.1"),
    (["429=2"], "--fault: '429=2' needs a rate between 0 and 1, such as 429=0.1"),
    (["429=0.6", "500=0.6"], "--fault: the rates add up to 1.2: they may not exceed 1"),
]


@pytest.mark.parametrize(("options", "text"), BAD_FAULTS)
def test_a_bad_fault_is_one_clear_sentence(options: list[str], text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_faults(options)
    assert str(caught.value) == text
