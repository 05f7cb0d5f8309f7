"""A key is read from the environment, and is in nothing that leaves the process except the request itself."""

from __future__ import annotations

import asyncio
import logging
import os
from typing import TYPE_CHECKING, Any

import pytest
from aiohttp import web

from khala_agents.build import Workshop, client_for
from khala_agents.config import ModelConfig, WorkerSpec
from khala_agents.llm.anthropic import Anthropic
from khala_agents.llm.client import MalformedCompletion
from khala_agents.llm.http import HttpAnswer
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES
from khala_agents.secret import MASK, excerpt, read_key, scrub
from khala_agents.worker import run_worker
from khala_protocol.bus import Delivery
from khala_protocol.errors import ConfigError
from khala_protocol.keys import everything

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable
    from pathlib import Path

    from khala_protocol.bus.memory import MemoryBroker
    from khala_protocol.messages import Briefing, Observation

KEY = "sk-very-secret-0123456789abcdef"


def test_a_key_is_read_from_its_variable_or_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_text(f"{KEY}\n", encoding="utf-8")
    assert read_key("K", {"K": KEY}).get_secret_value() == KEY
    assert read_key("K", {"K_FILE": str(file)}).get_secret_value() == KEY
    assert read_key("K", {"K": "other-key", "K_FILE": "/nowhere"}).get_secret_value() == "other-key"


BAD_KEYS = [
    ({}, "no key: set the environment variable K, or let K_FILE name a file that holds it"),
    ({"K": "  "}, "no key: set the environment variable K, or let K_FILE name a file that holds it"),
    ({"K": "two words"}, "K: the key has blanks, line breaks or other characters that no key has"),
    ({"K": "kéy"}, "K: the key has blanks, line breaks or other characters that no key has"),
    ({"K_FILE": "/nowhere/key"}, "K_FILE: the file '/nowhere/key' cannot be read"),
    ({"K_FILE": os.devnull}, f"K_FILE: the file {os.devnull!r} is empty: it should hold the key"),
]


@pytest.mark.parametrize(("environ", "text"), BAD_KEYS)
def test_a_key_that_is_none_is_one_clear_sentence_without_it(environ: dict[str, str], text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read_key("K", environ)
    assert str(caught.value) == text


def test_a_key_shows_itself_nowhere() -> None:
    key = read_key("K", {"K": KEY})
    for text in (repr(key), str(key), f"{key}", f"{key!r}", "%s" % key):  # noqa: UP031 - each way of writing it
        assert KEY not in text
    assert scrub(f"Incorrect API key: {KEY}!") == f"Incorrect API key: {MASK}!"


@pytest.mark.parametrize("most", [80, 200])
def test_a_key_is_masked_wherever_an_excerpt_ends(most: int) -> None:
    read_key("K", {"K": KEY})
    for before in range(most + 1):
        said = excerpt(("x" * before + KEY + " y" * 100).encode(), most)
        assert not any(KEY[begin : begin + 4] in said for begin in range(len(KEY) - 3)), before
        assert len(said) <= most


@pytest.mark.parametrize("kind", [OpenAICompatible, Anthropic])
def test_an_answer_that_is_no_completion_shows_no_part_of_a_key(kind: type[OpenAICompatible | Anthropic]) -> None:
    read_key("K", {"K": KEY})
    options: dict[str, Any] = {"profile": PROFILES["compatible"]} if kind is OpenAICompatible else {}
    model = kind(model="m", base_url="http://localhost/v1", prices=Prices(), key=None, **options)
    for before in range(210):
        with pytest.raises(MalformedCompletion) as caught:
            model._read(HttpAnswer(model.endpoint, 200, {}, b"x" * before + KEY.encode()), tools_offered=False)
        assert "sk-" not in str(caught.value)
        assert "x" * min(before, 70) in str(caught.value)


def test_an_excerpt_obeys_no_terminal() -> None:
    assert excerpt("a\x1b]0;b\x07\n c\u202ed\x9b") == r"a\x1b]0;b\x07 c\u202ed\x9b"


OPEN = ModelConfig(profile="compatible", model="m", base_url="http://example.org/v1", api_key_env="OPEN_KEY")


def test_a_key_that_crosses_a_network_unencrypted_is_warned_of_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("OPEN_KEY", KEY)
    for address in ("http://localhost:1/v1", "https://example.org/v1", "http://[::1]/v1"):
        client_for(OPEN.model_copy(update={"base_url": address}))
    assert caplog.messages == []
    client_for(OPEN)
    client_for(OPEN)
    assert caplog.messages == [
        "the key in OPEN_KEY goes to http://example.org/v1 unencrypted: everyone on the way can read it; use https://"
    ]


@pytest.fixture
async def echoing_server() -> AsyncIterator[str]:
    """Yield a server that puts its key into every answer: errors first, then completions."""
    asked = 0

    async def echo(request: web.Request) -> web.Response:
        nonlocal asked
        asked += 1
        said = request.headers.get("Authorization", "")
        assert KEY in said, "the request itself does carry the key"
        if asked == 1:
            return web.json_response({"error": {"message": f"you said {said}", "code": said}}, status=401)
        if asked == 2:
            return web.Response(status=400, text=f"<html>{said}")
        if asked == 3:
            return web.Response(text=f"no json {said}")
        return web.json_response({"choices": [{"message": {"content": f"Analysis: {said}"}}]})

    application = web.Application()
    application.router.add_post("/v1/chat/completions", echo)
    runner = web.AppRunner(application, shutdown_timeout=0.1)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    yield f"http://127.0.0.1:{runner.addresses[0][1]}/v1"
    await runner.cleanup()


async def test_a_key_is_in_no_log_message_or_recording_even_if_the_server_echoes_it(
    echoing_server: str, broker: MemoryBroker, host: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str],
    briefing: Callable[..., Briefing], observation: Callable[..., Observation],
) -> None:  # fmt: skip
    caplog.set_level(logging.DEBUG)
    monkeypatch.setenv("ECHO_KEY", KEY)
    model = tmp_path / "echo.yaml"
    model.write_text(
        f"profile: compatible\nmodel: echo\nbase_url: {echoing_server}\napi_key_env: ECHO_KEY\nretry: {{tries: 1}}\n",
        encoding="utf-8",
    )
    policy = Workshop().policy(WorkerSpec(model=str(model)))
    heard = await broker.session().subscribe(everything("test"), Delivery.SPEECH)
    logged = await broker.session().subscribe(everything("test"), Delivery.LOG)
    stop = asyncio.Event()
    playing = asyncio.create_task(run_worker(broker.session(), "test", "blue", "Stalkers", policy, stop=stop))
    await host.say(briefing())
    for step in range(4):
        await host.say(observation(step))
        await host.replies(step + 1)
    stop.set()
    tally = await playing
    await heard.close()
    await logged.close()
    payloads = [sample.payload async for sample in heard] + [sample.payload async for sample in logged]
    statuses = [reply.detail or reply.status for reply in await host.replies(4)]
    assert statuses == ["http 401", "http 400", "malformed", "ok"], "the server was asked and did answer"
    assert len(payloads) >= 8
    assert any(MASK.encode() in payload for payload in payloads)
    emitted = [*payloads, caplog.text, *capsys.readouterr(), repr(policy), repr(vars(policy)), repr(tally)]
    assert "http 401" in caplog.text
    for text in emitted:
        assert KEY not in (text.decode("utf-8", "replace") if isinstance(text, bytes) else text)


async def test_a_key_is_in_no_error_of_a_client(echoing_server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    import traceback

    from khala_agents.llm.client import LLMError, Request

    monkeypatch.setenv("ECHO_KEY", KEY)
    config = ModelConfig(profile="compatible", model="m", base_url=echoing_server, api_key_env="ECHO_KEY")
    client = client_for(config)
    for _ in range(3):
        with pytest.raises(LLMError) as caught:
            await client.complete(Request((), timeout_s=5.0))
        text = "".join(traceback.format_exception(caught.value)) + repr(caught.value) + repr(vars(caught.value))
        assert KEY not in text
    assert KEY not in (await client.complete(Request((), timeout_s=5.0))).text
    await client.close()
