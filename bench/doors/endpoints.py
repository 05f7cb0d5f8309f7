"""What endpoints and gateways answer that no completion of theirs should be: against a real client over loopback.

A row holds if the client says what became of the answer, in the words that a person needs. What got through is an
answer that is taken for orders, an error that is repeated in vain, or a text that does not say what to do.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from pydantic import ValidationError

from bench.doors.rows import Row
from khala_agents.build import client_for
from khala_agents.config import ModelConfig
from khala_agents.llm.client import (
    Completion,
    EndpointUnavailable,
    LLMError,
    MalformedCompletion,
    OutOfMoney,
    Request,
    RequestRefused,
    Unauthorized,
    Unreachable,
)
from khala_agents.scripted.canned import Canned, CannedRequest, Given, completion, refusal
from khala_protocol.messages import ChatMessage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path

DOOR = "endpoint"
KEY = "KHALA_DOORS_KEY"
ORDERS = "Actions:\nTeam A:\n<Attack_Unit(0x1)>"
PROMPT = (ChatMessage(role="system", content="You play."), ChatMessage(role="user", content="Game"))
LONG = (ChatMessage(role="user", content="Zealot 0x100200 at [12, 30]. " * 1000),)
TIME_S = 5.0


@dataclass(frozen=True, slots=True)
class Expected:
    """What a client must make of an answer.

    Attributes:
        verdict: of a completion; "" if an error is wanted.
        error: its kind, for an error.
        words: that its reason or text, or the log, must hold.
        requests: that were made, in one or more tries.
        tries: number of times the client is asked.
        billed: whether an error may be billed; None if that does not matter.
    """

    verdict: str = ""
    error: type[LLMError] | None = None
    words: tuple[str, ...] = ()
    requests: int = 1
    tries: int = 1
    billed: bool | None = None


@dataclass(frozen=True, slots=True)
class Quirk:
    """One row, as data: what is answered, to which client, and what must become of it."""

    what: str
    answer: Given | Callable[[CannedRequest], Given]
    expected: Expected
    model: Mapping[str, Any] = field(default_factory=dict)
    path: str = "/v1"
    prompt: tuple[ChatMessage, ...] = PROMPT


async def _play(quirk: Quirk, directory: Path) -> str:
    """Play a row; return how it got through."""
    del directory
    with _heard() as heard, _environment({KEY: "sk-doors-0123456789"}):
        async with Canned(quirk.answer) as server:
            fields = {"profile": "compatible", "model": "m", "max_tokens": 99, "api_key_env": KEY, **quirk.model}
            client = client_for(ModelConfig.model_validate({**fields, "base_url": server.root + quirk.path}))
            outcome: Completion | LLMError = Completion("")
            for _ in range(quirk.expected.tries):
                try:
                    outcome = await client.complete(Request(quirk.prompt, timeout_s=TIME_S))
                except LLMError as error:
                    outcome = error
            await client.close()
        made = len(server.asked)
    wanted = quirk.expected
    if made != wanted.requests:
        return f"{made} requests were made, and {wanted.requests} are enough"
    return _compare(outcome, wanted, "\n".join(heard))


def _compare(outcome: Completion | LLMError, wanted: Expected, heard: str) -> str:
    if isinstance(outcome, LLMError):
        if type(outcome) is not wanted.error:
            return f"it was the error {type(outcome).__name__}: {outcome}"
        if wanted.billed is not None and outcome.may_be_billed != wanted.billed:
            return f"may_be_billed is {outcome.may_be_billed}"
        said = str(outcome)
    else:
        if outcome.verdict != wanted.verdict:
            return f"it was taken as {outcome.verdict!r}: {outcome.text!r}"
        said = outcome.reason
    missing = [words for words in wanted.words if words not in f"{said}\n{heard}"]
    return f"nothing says {missing[0]!r}, but: {said}" if missing else ""


@contextlib.contextmanager
def _heard() -> Iterator[list[str]]:
    """Yield what is logged in the meantime."""
    lines: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())  # type: ignore[method-assign]  # a sink
    logger = logging.getLogger("khala_agents")
    logger.addHandler(handler)
    try:
        yield lines
    finally:
        logger.removeHandler(handler)


@contextlib.contextmanager
def _environment(changes: Mapping[str, str]) -> Iterator[None]:
    before = dict(os.environ)
    os.environ.update(changes)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


# --- what is answered ---------------------------------------------------------------------------------


def _refuses(name: str) -> Callable[[CannedRequest], Given]:
    said = refusal(400, f"Unsupported parameter: '{name}' is not supported with this model.", param=name)
    return lambda asked: said if name in asked.body else completion(ORDERS)


def _two_roles(asked: CannedRequest) -> Given:
    roles = [message["role"] for message in asked.body["messages"]]
    return completion(ORDERS) if roles == ["user"] else refusal(400, "System role not supported")


def _strict(asked: CannedRequest) -> Given:
    return completion(ORDERS) if asked.path == "/v1/chat/completions" else refusal(404, "Not Found")


def _azure(asked: CannedRequest) -> Given:
    if asked.headers.get("api-key") != "sk-doors-0123456789" or "authorization" in asked.headers:
        return refusal(401, "Access denied due to missing subscription key.")
    if asked.query.get("api-version") != "2024-10-21":
        return refusal(404, "Resource not found")
    return completion(ORDERS)


def _anthropic(*content: Any, stop: str = "end_turn", usage: Any = None) -> Given:
    return Given({"type": "message", "content": list(content), "stop_reason": stop, "usage": usage})


OK = Expected("ok")
ANTHROPIC = {"profile": "anthropic"}
GEMINI = {"profile": "gemini"}
RESPONSES = {"profile": "responses"}
AZURE = {"key_header": "api-key", "query": {"api-version": "2024-10-21"}}
TOOL = {"id": "1", "type": "function", "function": {"name": "Attack_Unit", "arguments": "{}"}}
BROKEN = Expected(error=EndpointUnavailable, words=("broke its answer off",), billed=True)
FILTERED = {"error": {"message": "Filtered.", "code": "content_filter"}}
TEXT = {"type": "text", "text": ORDERS}
FEW = {"prompt_tokens": 2048, "completion_tokens": 5}

QUIRKS: Final[tuple[Quirk, ...]] = (
    Quirk(
        "reasoning eats max_tokens",
        completion(None, "length", reasoning_content="hm"),
        Expected("cut", words=("99", "raise max_tokens")),
    ),
    Quirk("reasoning that is not closed", completion(f"<think>{ORDERS}", "length"), Expected("cut", words=("99",))),
    Quirk("nothing at all", completion(None), Expected("empty", words=("said nothing",))),
    Quirk("a thought and nothing else", completion("<think>hm</think>"), Expected("empty", words=("thought",))),
    Quirk("tools that nobody offered", completion(None, tool_calls=[TOOL]), Expected("ok", words=("called tools",))),
    Quirk(
        "a refusal in its own field",
        completion(None, refusal="I will not."),
        Expected("refused", words=("I will not.",)),
    ),
    Quirk(
        "a refusal in prose",
        completion("I'm sorry, but I can't help with that."),
        Expected("refused", words=("sorry",)),
    ),
    Quirk("finish_reason content_filter", completion(None, "content_filter"), Expected("filtered")),
    Quirk("finish_reason SAFETY", completion("", "SAFETY"), Expected("filtered")),
    Quirk("a prompt that a filter refuses", Given(FILTERED, 400), Expected("filtered", words=("Filtered.",))),
    Quirk(
        "the answer in reasoning_content",
        completion("", reasoning_content=ORDERS),
        Expected("ok", words=("among the model's reasoning",)),
    ),
    Quirk("half an answer and finish_reason error", completion("Actions:\nTeam", "error"), BROKEN),
    Quirk(
        "an answer with an error beside it",
        Given({"choices": [{"message": {"content": ORDERS}}], "error": {"message": "gone"}}),
        BROKEN,
    ),
    Quirk(
        "a choice without a message",
        Given({"choices": [{}]}),
        Expected(error=MalformedCompletion, words=("no message",), billed=True),
    ),
    Quirk("an answer that was cut, with words", completion(ORDERS, "length"), OK),
    Quirk("usage that is no usage", completion(ORDERS, usage="none"), OK),
    Quirk("a mark of byte order", Given(b'\xef\xbb\xbf{"choices": [{"message": {"content": "go"}}]}'), OK),
    Quirk(
        "temperature is refused",
        _refuses("temperature"),
        Expected("ok", words=("leaves temperature out",), requests=3, tries=2),
        {"temperature": 0.2},
    ),
    Quirk(
        "max_tokens is refused",
        _refuses("max_tokens"),
        Expected("ok", words=("max_completion_tokens",), requests=3, tries=2),
    ),
    Quirk(
        "max_tokens is too large",
        refusal(400, "'max_tokens' is too large, unsupported"),
        Expected(error=RequestRefused),
    ),
    Quirk("no system role", _two_roles, Expected("ok", words=("in front of the first message",), requests=3, tries=2)),
    Quirk("Azure's key, header and query", _azure, OK, AZURE, "/openai/deployments/d"),
    Quirk(
        "a context that is too small",
        completion(ORDERS, usage=FEW),
        Expected("ok", words=("OLLAMA_CONTEXT_LENGTH", "num_ctx")),
        prompt=LONG,
    ),
    Quirk(
        "an error text with 200, no /v1",
        Given({"error": "Unexpected endpoint"}),
        Expected(error=RequestRefused, words=("/chat/completions answered", "/v1")),
        path="",
    ),
    Quirk("a whole request's address as base", _strict, OK, path="/v1/chat/completions"),
    Quirk(
        "404 without /v1",
        refusal(404, "Not Found"),
        Expected(error=RequestRefused, words=("/messages answered", "/v1")),
        ANTHROPIC,
        "",
    ),
    Quirk(
        "a textual code with 200",
        Given({"error": {"code": "rate_limit_exceeded", "message": "slow"}}),
        Expected(error=EndpointUnavailable, words=("slow",), billed=False),
    ),
    Quirk(
        "overloaded_error with 200",
        Given({"type": "error", "error": {"type": "overloaded_error", "message": "busy"}}),
        Expected(error=EndpointUnavailable, words=("busy",), billed=False),
        ANTHROPIC,
    ),
    Quirk(
        "invalid_api_key with 200",
        Given({"error": {"code": "invalid_api_key", "message": "no"}}),
        Expected(error=Unauthorized),
    ),
    Quirk("no credit, as 400", refusal(400, "Your credit balance is too low."), Expected(error=OutOfMoney), ANTHROPIC),
    Quirk(
        "a redirect",
        Given(b"", 308, {"Location": "https://new.example/v1/messages"}),
        Expected(error=RequestRefused, words=("https://new.example/v1",)),
        ANTHROPIC,
    ),
    Quirk(
        "an answer in pieces",
        Given(b"data: {}\n\ndata: [DONE]\n\n"),
        Expected(error=MalformedCompletion, words=("streaming off",)),
    ),
    Quirk("stop_reason refusal", _anthropic(stop="refusal"), Expected("refused"), ANTHROPIC),
    Quirk(
        "thinking blocks alone",
        _anthropic({"type": "thinking"}, stop="max_tokens"),
        Expected("cut", words=("99",)),
        ANTHROPIC,
    ),
    Quirk(
        "a prompt that Gemini blocks",
        Given({"promptFeedback": {"blockReason": "SAFETY"}}),
        Expected("filtered", words=("SAFETY",)),
        GEMINI,
    ),
    Quirk(
        "thoughts alone of Gemini",
        Given({"candidates": [{"finishReason": "MAX_TOKENS"}], "usageMetadata": {"thoughtsTokenCount": 99}}),
        Expected("cut", words=("99", "on its reasoning")),
        GEMINI,
    ),
    Quirk(
        "a wrong key of Gemini, as 400",
        refusal(400, "API key not valid. Please pass a valid API key."),
        Expected(error=Unauthorized),
        GEMINI,
    ),
    Quirk(
        "an incomplete response",
        Given({"output": [{"type": "reasoning"}], "incomplete_details": {"reason": "max_output_tokens"}}),
        Expected("cut", words=("99",)),
        RESPONSES,
    ),
    Quirk(
        "a response that failed",
        Given({"output": [], "status": "failed", "error": {"code": "server_error", "message": "gone"}}),
        BROKEN,
        RESPONSES,
    ),
    Quirk("input_tokens: null", _anthropic(TEXT, usage={"input_tokens": None, "output_tokens": 5}), OK, ANTHROPIC),
)


# --- what is no answer --------------------------------------------------------------------------------


async def _play_proxy(directory: Path) -> str:
    """Have a proxy in the environment that never answers; loopback must not need it, and elsewhere must use it."""
    del directory
    proxies = dict.fromkeys(("HTTP_PROXY", "http_proxy", "HTTPS_PROXY", "ALL_PROXY", "all_proxy"), "http://127.0.0.1:1")
    with _environment({**proxies, "NO_PROXY": "", "no_proxy": ""}):
        async with Canned(completion(ORDERS)) as server:
            outcome = await _ask({"base_url": server.base_url})
        if isinstance(outcome, LLMError):
            return f"this machine was asked through a proxy: {outcome}"
        outcome = await _ask({"base_url": "http://model.invalid/v1"})
    if not isinstance(outcome, Unreachable) or "through the proxy http://127.0.0.1:1" not in str(outcome):
        return f"another machine was not asked through the proxy: {outcome}"
    return "a request that never left may be billed" if outcome.may_be_billed else ""


async def _play_password(directory: Path) -> str:
    """Have a proxy refuse, and look for its password in the error."""
    del directory

    async def refuse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(b"HTTP/1.1 407 Proxy Authentication Required\r\nContent-Length: 0\r\n\r\n")
        await writer.drain()
        writer.close()

    async with await asyncio.start_server(refuse, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        proxy = f"http://me:hidden@127.0.0.1:{port}"
        with _environment({"HTTPS_PROXY": proxy, "https_proxy": proxy, "NO_PROXY": "", "no_proxy": ""}):
            outcome = await _ask({"base_url": "https://model.invalid/v1"})
    if not isinstance(outcome, Unreachable) or "through the proxy" not in str(outcome):
        return f"it was {outcome}"
    return f"the password is shown: {outcome}" if "hidden" in str(outcome) else ""


async def _play_streaming(directory: Path) -> str:
    """Ask for answers in pieces, and for several answers at once."""
    del directory
    fields = {"profile": "compatible", "model": "m", "base_url": "http://127.0.0.1:1/v1"}
    for extra in ({"stream": True}, {"n": 8}):
        with contextlib.suppress(ValidationError):
            ModelConfig.model_validate({**fields, "extra": extra})
            return f"{extra} was taken"
    return ""


async def _play_key(directory: Path) -> str:
    """Write a key into a header or the query of a model file."""
    del directory
    fields = {"profile": "compatible", "model": "m", "base_url": "http://127.0.0.1:1/v1"}
    for place in ({"headers": {"Authorization": "Bearer sk-1"}}, {"query": {"key": "sk-1"}}):
        with contextlib.suppress(ValidationError):
            ModelConfig.model_validate({**fields, **place})
            return f"{place} was taken"
    return ""


async def _play_break(directory: Path) -> str:
    """End the connection after the request has arrived: an answer may be on its way, and billed."""
    del directory

    async def leave(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.close()

    async with await asyncio.start_server(leave, "127.0.0.1", 0) as server:
        outcome = await _ask({"base_url": f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}/v1"})
    if not isinstance(outcome, Unreachable):
        return f"it was {outcome}"
    return "" if outcome.may_be_billed else "a request that arrived counts as one that was never sent"


async def _ask(fields: Mapping[str, Any]) -> Completion | LLMError:
    client = client_for(ModelConfig.model_validate({"profile": "compatible", "model": "m", **fields}))
    try:
        return await client.complete(Request(PROMPT, timeout_s=TIME_S))
    except LLMError as error:
        return error
    finally:
        await client.close()


ROWS: Final[tuple[Row, ...]] = (
    *(Row(DOOR, quirk.what, partial(_play, quirk), "quirk") for quirk in QUIRKS),
    Row(DOOR, "a proxy that never answers", _play_proxy, "fault"),
    Row(DOOR, "a proxy that refuses its password", _play_password, "quirk"),
    Row(DOOR, "a connection that ends after the request", _play_break, "fault"),
    Row("model file", "streamed answers, or eight of them", _play_streaming, "quirk"),
    Row("model file", "a key in a header or the query", _play_key, "quirk"),
)
