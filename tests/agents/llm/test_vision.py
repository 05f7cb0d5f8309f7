"""The cost of pictures, by the rule of each kind of endpoint, and the settings of a model that sees."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from khala_agents.config import ModelConfig, load_model, model_files
from khala_agents.llm.client import estimated_image_tokens, estimated_tokens
from khala_agents.llm.profiles import PROFILES
from khala_agents.llm.vision import ANTHROPIC, OPENAI, OPENAI_REASONING, QWEN, Detail, TokenRule, Vision
from khala_protocol.messages import ChatMessage, ImageRef

MINI = TokenRule(kind="patches", pixels=32, most=1536, each=1.62)


@pytest.mark.parametrize(
    ("rule", "width", "height", "detail", "tokens"),
    [
        (ANTHROPIC, 512, 512, "auto", 350),  # 262144 / 750
        (ANTHROPIC, 200, 200, "auto", 54),  # their own table
        (ANTHROPIC, 1000, 1000, "auto", 1334),
        (ANTHROPIC, 1092, 1092, "auto", 1590),
        (ANTHROPIC, 2048, 2048, "auto", 1600),  # made smaller by them
        (OPENAI, 512, 512, "low", 85),
        (OPENAI, 2048, 2048, "low", 85),
        (OPENAI, 512, 512, "high", 85 + 170),  # one tile
        (OPENAI, 513, 512, "auto", 85 + 2 * 170),
        (OPENAI, 1024, 1024, "high", 85 + 4 * 170),  # 768 x 768: their own example
        (OPENAI, 2048, 4096, "high", 85 + 6 * 170),  # 768 x 1536: their own example
        (OPENAI_REASONING, 512, 512, "auto", 75 + 150),
        (MINI, 1024, 1024, "auto", 1659),  # 32 x 32 patches, times 1.62
        (MINI, 2048, 2048, "auto", 2489),  # never more than 1536 patches
        (QWEN, 512, 512, "auto", 19 * 19),
        (TokenRule(kind="fixed", base=256), 512, 512, "auto", 256),
    ],
)
def test_a_picture_takes_so_many_tokens(rule: TokenRule, width: int, height: int, detail: Detail, tokens: int) -> None:
    assert rule.tokens(width, height, detail) == tokens


def ref(name: str = "screen", size: int = 512, title: str = "1234") -> ImageRef:
    return ImageRef(name=name, media_type="image/jpeg", sha256=name, title=title, width=size, height=size, bytes=9)


def test_a_prompt_is_estimated_with_its_pictures_and_their_titles() -> None:
    prompt = (ChatMessage(role="user", content="12345678", images=(ref("a"), ref("b", 1024))),)
    vision = Vision(tokens=ANTHROPIC)
    assert estimated_tokens(prompt) == 2 + 1 + 1
    assert estimated_tokens(prompt, vision) == 4 + 350 + 1399
    assert estimated_image_tokens(prompt, vision) == 350 + 1399


def model(**changes: Any) -> ModelConfig:
    fields: dict[str, Any] = {"profile": "openai", "model": "m", "base_url": "http://x/v1", "api_key_env": "KEY"}
    return ModelConfig.model_validate(fields | changes)


@pytest.mark.parametrize("said", [None, False])
def test_a_model_sees_nothing_unless_its_file_says_so(said: bool | None) -> None:
    assert model(images=said).vision is None
    assert model().vision is None


def test_a_model_that_sees_counts_as_its_profile_does_unless_its_file_says_more() -> None:
    assert model(images=True).vision == Vision(tokens=OPENAI)
    assert model(images=True, profile="anthropic").vision == Vision(tokens=ANTHROPIC)
    own = {"kind": "fixed", "base": 258}
    assert model(images={"detail": "low", "tokens": own}).vision == Vision(detail="low", tokens=TokenRule(**own))


def test_every_profile_has_a_rule() -> None:
    assert all(profile.image_tokens.tokens(512, 512) > 0 for profile in PROFILES.values())


def test_of_the_shipped_models_these_see() -> None:
    sees = {name for name in model_files() if load_model(name).images}
    shipped_as_themselves = {"claude3-haiku", "gpt-4o", "gpt-4o-mini"}
    assert sees == {"anthropic", "gemini", "openai", "openai-responses", "scripted"} | shipped_as_themselves


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"detail": "best"}, "'auto', 'low' or 'high'"),
        ({"tokens": {"kind": "guess"}}, "'area', 'tiles', 'patches' or 'fixed'"),
        ({"max_images": 0}, "greater than or equal to 1"),
        ({"size": 5}, "Extra inputs are not permitted"),
        ("yes", "valid dictionary or instance of Vision"),
    ],
)
def test_what_is_wrong_in_a_model_file_is_said(wrong: object, words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        model(images=wrong)
