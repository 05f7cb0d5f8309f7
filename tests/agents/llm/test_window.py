"""The context of a model: what endpoints tell of it, what their refusals say, and how tokens are counted."""

from __future__ import annotations

from typing import Any

import pytest

from khala_agents.llm.window import ContextWindow, TokenScale, context_in, told_context
from khala_protocol.messages import Usage


@pytest.mark.parametrize(
    ("refusal", "limit", "sent"),
    [
        ("maximum context length is 8192 tokens. However, your messages resulted in 9000 tokens.", 8192, 9000),
        ("context length is 2048 tokens. However, you requested 2500 (2200 in the messages, 300 in the completion)",
         2048, 2200),
        ("'max_tokens' is too large: 1000. The maximum context length is 2048 tokens, and it has 1500 input tokens",
         2048, 1500),
        ("request (2311 tokens) exceeds the available context size (1024 tokens), try increasing it", 1024, 2311),
        ("the request exceeds the available context size. try increasing the context size", None, None),
        ("prompt is too long: 213462 tokens > 200000 maximum", 200000, 213462),
        ("The input token count (1200000) exceeds the maximum number of tokens allowed (1048575).", 1048575, 1200000),
        ("Prompt contains 40000 tokens, too large for model with 32768 maximum context length", 32768, 40000),
        ("Trying to keep 4096 tokens. However, it is loaded with context length of only 2048 tokens", 2048, None),
        ("`inputs` tokens + `max_new_tokens` must be <= 4096. Given: 3900 `inputs` tokens and 1000 `max_new_tokens`",
         4096, 3900),
        ("Requested tokens (2311) exceed context window of 1024", 1024, 2311),
    ],
)  # fmt: skip
def test_a_refusal_names_the_context_and_the_prompt(refusal: str, limit: int | None, sent: int | None) -> None:
    assert context_in(refusal) == (limit, sent)


@pytest.mark.parametrize("refusal", ["there is no model 'x'", "temperature is too large: at most 2", "invalid api key"])
def test_another_refusal_says_nothing_of_a_context(refusal: str) -> None:
    window = ContextWindow()
    assert not window.learn(refusal, 1000, 100)
    assert window.room(100) is None


def test_a_prompt_of_digits_is_fitted_by_what_the_endpoint_counted() -> None:
    scale = TokenScale()
    window = ContextWindow(2048, scale)
    assert window.room(548) == int(1500 / (1.4 * 1.03))  # as long as nothing is counted
    scale.learn_from(Usage(requests=1, prompt_tokens=3000, completion_tokens=9), 1000)  # a token for each digit
    assert window.room(548) == int(1500 / (3 * 1.03))
    assert scale.most(1000) == pytest.approx(3450)


def test_usage_that_is_unknown_teaches_nothing() -> None:
    scale = TokenScale()
    scale.learn_from(Usage(requests=1, unknown_requests=1), 1000)
    assert (scale.known, scale.factor, scale.most(100)) == (False, 1.0, 200.0)


@pytest.mark.parametrize(
    "refusal",
    ["request (2000 tokens) exceeds the available context size (1024 tokens)", "context length is only 1024",
     "the input is too long"],
)  # fmt: skip
def test_after_each_refusal_there_is_less_room(refusal: str) -> None:
    window = ContextWindow()
    rooms = []
    estimated = 1500
    for _ in range(3):
        assert window.learn(refusal, estimated, 200)
        estimated = window.room(200) or 0
        rooms.append(estimated)
    assert 1500 > rooms[0] >= rooms[1] >= rooms[2] > 50
    assert rooms[0] < 1500 * 0.98


@pytest.mark.parametrize(
    ("profile", "said", "size"),
    [
        ("llamacpp", {"//props": {"default_generation_settings": {"n_ctx": 8192}}}, 8192),
        ("vllm", {"/models": {"data": [{"id": "other"}, {"id": "mine", "max_model_len": 4096}]}}, 4096),
        ("ollama", {"//api/ps": {"models": [{"name": "mine", "context_length": 4096}]}}, 4096),
        ("ollama", {"//api/ps": {"models": []}}, None),
        ("openrouter", {"/models": {"data": [{"id": "mine", "context_length": 200000}, {"id": "x"}]}}, 200000),
        ("compatible", {"//api/v0/models": {"data": [{"id": "mine", "loaded_context_length": 2048}]}}, 2048),
        ("compatible", {"/models": ["nonsense"], "//props": {"default_generation_settings": {"n_ctx": True}}}, None),
        ("openai", {"/models": {"data": [{"id": "mine", "context_length": 1}]}}, None),
    ],
)
async def test_an_endpoint_may_tell_its_context(profile: str, said: dict[str, Any], size: int | None) -> None:
    async def read(address: str) -> Any:
        return said.get(address)

    assert await told_context(profile, "mine", read) == size
