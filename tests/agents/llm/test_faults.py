"""Errors of endpoints and gateways: what they are, also with "200 OK", and what their texts tell to do."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import SecretStr

from khala_agents.llm.anthropic import Anthropic
from khala_agents.llm.client import (
    EndpointUnavailable,
    LLMError,
    MalformedCompletion,
    OutOfMoney,
    Request,
    RequestRefused,
    Unauthorized,
)
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES
from khala_agents.scripted.canned import Canned, Given
from khala_protocol.messages import ChatMessage

PROMPT = (ChatMessage(role="user", content="Game"),)


async def error_of(answer: Given, path: str = "/v1", kind: str = "openai") -> tuple[LLMError, str]:
    """Return the error of a request to a base with this path, and the address of the server."""
    async with Canned(answer) as server:
        base_url = server.root + path
        model: OpenAICompatible | Anthropic
        if kind == "openai":
            model = OpenAICompatible(PROFILES["compatible"], model="m", base_url=base_url, prices=Prices())
        else:
            model = Anthropic(model="m", base_url=base_url, prices=Prices(), key=SecretStr("sk-ant-0123"))
        try:
            with pytest.raises(LLMError) as caught:
                await model.complete(Request(PROMPT, timeout_s=5.0))
        finally:
            await model.close()
    return caught.value, server.root


def said(**error: Any) -> Given:
    return Given({"error": {"message": "because", **error}})


LONG = "Rate limit reached for this key, and a sentence that goes on: " + "word " * 40 + "end"
INSIDE: list[tuple[Given, type[LLMError], str]] = [
    (said(code=503), EndpointUnavailable, "http 503"),
    (said(code="429"), EndpointUnavailable, "http 429"),
    (said(code="rate_limit_exceeded"), EndpointUnavailable, "http 429"),
    (said(code="rate_limit_daily", type="rate_limit"), EndpointUnavailable, "http 429"),
    (said(type="RateLimitError", code=None), EndpointUnavailable, "http 429"),
    (said(status="RESOURCE_EXHAUSTED"), EndpointUnavailable, "http 429"),
    (said(code="engine_overloaded"), EndpointUnavailable, "http 529"),
    (said(type="server_error"), EndpointUnavailable, "http 500"),
    (said(type="timeout_error"), EndpointUnavailable, "http 504"),
    (said(code="insufficient_quota"), OutOfMoney, "http 402"),
    (said(code="invalid_api_key"), Unauthorized, "http 401"),
    (said(code="model_not_found"), RequestRefused, "http 404"),
    (said(code="context_length_exceeded"), RequestRefused, "http 400"),
    (Given([{"error": {"code": 429, "message": "because"}}]), EndpointUnavailable, "http 429"),
    (Given({"object": "error", "message": "because", "code": 503}), EndpointUnavailable, "http 503"),
    (Given({"choices": None, "error": {"code": 429, "message": "because"}}), EndpointUnavailable, "http 429"),
    (said(code="brand_new_code"), MalformedCompletion, "malformed"),
    (Given({"error": {"code": 503, "detail": "because"}}), EndpointUnavailable, "http 503"),
    (Given({"error": "because the model is loading"}), MalformedCompletion, "malformed"),
]


@pytest.mark.parametrize(("answer", "kind", "status"), INSIDE)
async def test_an_error_with_ok_is_the_error_that_its_code_says(
    answer: Given, kind: type[LLMError], status: str
) -> None:
    error, _ = await error_of(answer)
    assert (type(error), error.status) == (kind, status)
    assert "because" in str(error)


async def test_the_reason_of_an_error_with_ok_is_not_cut() -> None:
    error, _ = await error_of(Given({"error": {"code": "rate_limit_exceeded", "message": LONG}}))
    assert LONG in str(error)


async def test_what_a_gateway_quotes_of_its_provider_is_quoted() -> None:
    metadata = {"raw": "Too Many Requests", "provider_name": "X"}
    error, _ = await error_of(
        Given({"error": {"code": 429, "message": "Provider returned error", "metadata": metadata}})
    )
    assert "Provider returned error: Too Many Requests" in str(error)


OF_ANTHROPIC = [
    ("overloaded_error", EndpointUnavailable, "http 529", False),
    ("rate_limit_error", EndpointUnavailable, "http 429", False),
    ("api_error", EndpointUnavailable, "http 500", True),
    ("timeout_error", EndpointUnavailable, "http 504", True),
    ("authentication_error", Unauthorized, "http 401", False),
    ("permission_error", Unauthorized, "http 403", False),
    ("billing_error", OutOfMoney, "http 402", False),
    ("not_found_error", RequestRefused, "http 404", False),
    ("request_too_large", RequestRefused, "http 413", False),
    ("invalid_request_error", RequestRefused, "http 400", False),
]


@pytest.mark.parametrize(("name", "kind", "status", "billed"), OF_ANTHROPIC)
async def test_an_error_of_anthropic_with_ok_is_the_error_that_its_type_says(
    name: str, kind: type[LLMError], status: str, *, billed: bool
) -> None:
    answer = Given({"type": "error", "error": {"type": name, "message": "because"}})
    error, root = await error_of(answer, kind="anthropic")
    assert (type(error), error.status, error.may_be_billed) == (kind, status, billed)
    assert str(error).startswith(f"{root}/v1/messages answered {status}: because")


STATUSES: list[tuple[Given, type[LLMError], str]] = [
    (
        Given({"error": {"type": "invalid_request_error", "message": "Your credit balance is too low."}}, 400),
        OutOfMoney,
        "the account has no money or quota left",
    ),
    (Given([{"error": {"code": 400, "message": "API key not valid."}}], 400), Unauthorized, "is the key right"),
    (Given({"error": {"message": "no", "type": "insufficient_quota", "code": None}}, 429), OutOfMoney, "no money"),
    (Given(b"<html>Bad Gateway</html>", 502), EndpointUnavailable, "answered http 502: <html>Bad Gateway</html>"),
]  # fmt: skip


@pytest.mark.parametrize(("answer", "kind", "words"), STATUSES)
async def test_the_words_of_an_error_tell_whose_fault_it_is(answer: Given, kind: type[LLMError], words: str) -> None:
    error, _ = await error_of(answer)
    assert type(error) is kind
    assert words in str(error)


# --- addresses ----------------------------------------------------------------------------------------

LOST = Given({"error": "Unexpected endpoint or method. (POST /chat/completions)"})


@pytest.mark.parametrize(("answer", "path"), [
    (LOST, ""),
    (LOST, "/v1"),
    (Given({"error": "what is this?"}), ""),
    (Given({"detail": "Not Found"}, 404), ""),
])  # fmt: skip
async def test_an_address_that_is_not_there_is_refused_once_and_says_what_was_asked(answer: Given, path: str) -> None:
    error, root = await error_of(answer, path)
    assert type(error) is RequestRefused
    assert str(error).startswith(f"{root}{path}/chat/completions answered ")
    assert (f"most addresses end in /v1: try base_url {root}/v1" in str(error)) == (path == "")


async def test_anthropic_without_a_version_says_which_address_to_try() -> None:
    error, root = await error_of(Given({"detail": "Not Found"}, 404), "", kind="anthropic")
    assert str(error).startswith(f"{root}/messages answered http 404")
    assert str(error).endswith(f"; most addresses end in /v1: try base_url {root}/v1")


@pytest.mark.parametrize("pasted", ["/v1", "/v1/", "/v1/chat/completions", "/v1/chat/completions/", "/v1/messages"])
async def test_the_address_of_a_whole_request_is_a_base_as_well(pasted: str) -> None:
    error, root = await error_of(Given({"detail": "no such model"}, 404), pasted)
    assert str(error) == f'{root}/v1/chat/completions answered http 404: {{"detail":"no such model"}}'


MOVED = [
    ("https://new.example/v1/chat/completions?key=secret", "set base_url to https://new.example/v1"),
    ("/other/v1/chat/completions", "/other/v1"),
    ("", "it has moved, and does not say where"),
]


@pytest.mark.parametrize("status", [301, 302, 307, 308])
@pytest.mark.parametrize(("place", "words"), MOVED)
async def test_an_endpoint_that_has_moved_names_its_new_address(status: int, place: str, words: str) -> None:
    error, _ = await error_of(Given(b"", status, {"Location": place} if place else {}))
    assert (type(error), error.status) == (RequestRefused, f"http {status}")
    assert str(error).endswith(words)
    assert "secret" not in str(error)


async def test_an_answer_in_pieces_says_to_switch_streaming_off() -> None:
    pieces = b': PROCESSING\n\ndata: {"choices": [{"delta": {"content": "go"}}]}\n\ndata: [DONE]\n\n'
    error, _ = await error_of(Given(pieces, headers={"Content-Type": "text/event-stream"}))
    assert type(error) is MalformedCompletion
    assert "answered in pieces (text/event-stream)" in str(error)
    assert "switch streaming off" in str(error)
