"""How endpoints that speak OpenAI's chat completions differ from each other: one row each.

A row says what an endpoint of this kind must be sent or asked differently, nothing else: a model file has the
address, model, prices and the name of the key. What no row covers is written there under `extra`.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

from khala_agents.llm.vision import OPENAI, OPENAI_REASONING, QWEN, TokenRule

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.llm.quirks import SystemRole

ProfileName = Literal[
    "openai",
    "openai-reasoning",
    "deepseek",
    "glm",
    "openrouter",
    "vllm",
    "ollama",
    "llamacpp",
    "litellm",
    "scripted",
    "compatible",
]


@dataclass(frozen=True, slots=True)
class Profile:
    """The particulars of one kind of endpoint.

    Attributes:
        length_field: name of the limit of generated tokens.
        system_role: role of the system message; `fold` puts it in front of the first message of the user.
        temperature: whether `temperature` may be sent; a reasoning model refuses it with 400.
        seed: whether `seed` may be sent.
        cached_path: where in `usage` the number of cached prompt tokens stands.
        reasoning_path: where in `usage` the number of reasoning tokens stands.
        needs_key: whether it requires a key.
        image_tokens: how it counts pictures, for models that see.
        grammar_field: where in a request a grammar stands; () for an endpoint that takes none.
    """

    length_field: Literal["max_tokens", "max_completion_tokens"] = "max_tokens"
    system_role: SystemRole = "system"
    temperature: bool = True
    seed: bool = True
    cached_path: tuple[str, ...] = ("prompt_tokens_details", "cached_tokens")
    reasoning_path: tuple[str, ...] = ("completion_tokens_details", "reasoning_tokens")
    needs_key: bool = False
    image_tokens: TokenRule = QWEN
    grammar_field: tuple[str, ...] = ()


PROFILES: Mapping[ProfileName, Profile] = MappingProxyType(
    {
        "openai": Profile(length_field="max_completion_tokens", needs_key=True, image_tokens=OPENAI),
        # `max_tokens` and a temperature are refused with 400; the system role is called `developer`
        "openai-reasoning": Profile(
            length_field="max_completion_tokens",
            system_role="developer",
            temperature=False,
            needs_key=True,
            image_tokens=OPENAI_REASONING,
        ),
        "deepseek": Profile(cached_path=("prompt_cache_hit_tokens",), seed=False, needs_key=True),
        "glm": Profile(seed=False, needs_key=True),
        "openrouter": Profile(needs_key=True),
        "vllm": Profile(grammar_field=("structured_outputs", "grammar")),
        "ollama": Profile(),
        "llamacpp": Profile(grammar_field=("grammar",)),
        "litellm": Profile(),
        "scripted": Profile(image_tokens=OPENAI),
        "compatible": Profile(),
    }
)
