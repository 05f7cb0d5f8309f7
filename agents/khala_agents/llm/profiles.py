"""How endpoints differ from each other: one row for each kind.

Most speak OpenAI's chat completions. A row says what an endpoint of this kind must be sent or asked differently,
nothing else: a model file has the address, model, prices and the name of the key. What no row covers is written there
under `extra`.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

from khala_agents.llm.vision import ANTHROPIC, GEMINI, OPENAI, OPENAI_REASONING, QWEN, TokenRule

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_agents.llm.effort import EffortField
    from khala_agents.llm.quirks import SystemRole

ProfileName = Literal[
    "openai",
    "openai-reasoning",
    "responses",
    "anthropic",
    "gemini",
    "deepseek",
    "glm",
    "qwen",
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
        api: what it speaks.
        length_field: name of the limit of generated tokens.
        system_role: role of the system message; `fold` puts it in front of the first message of the user.
        system_roles: the roles that a model file may name instead.
        temperature: whether `temperature` may be sent; a reasoning model refuses it with 400.
        seed: whether `seed` may be sent.
        stop: whether the texts that end an answer may be sent.
        effort_field: the field that says how much the model thinks.
        json_schema: whether it takes a schema; another is only asked for some object of JSON.
        batch: whether it takes requests in batches, at half the price.
        cached_path: where in `usage` the number of cached prompt tokens stands.
        reasoning_path: where in `usage` the number of reasoning tokens stands.
        needs_key: whether it requires a key.
        image_tokens: how it counts pictures, for models that see.
        grammar_field: where in a request a grammar stands; () for an endpoint that takes none.
    """

    api: Literal["chat", "responses", "anthropic", "gemini"] = "chat"
    length_field: Literal["max_tokens", "max_completion_tokens", "max_output_tokens", "maxOutputTokens"] = "max_tokens"
    system_role: SystemRole = "system"
    system_roles: tuple[SystemRole, ...] = ("system", "developer", "user", "fold")
    temperature: bool = True
    seed: bool = True
    stop: bool = True
    effort_field: EffortField = "reasoning_effort"
    json_schema: bool = True
    batch: bool = False
    cached_path: tuple[str, ...] = ("prompt_tokens_details", "cached_tokens")
    reasoning_path: tuple[str, ...] = ("completion_tokens_details", "reasoning_tokens")
    needs_key: bool = False
    image_tokens: TokenRule = QWEN
    grammar_field: tuple[str, ...] = ()


PROFILES: Mapping[ProfileName, Profile] = MappingProxyType(
    {
        "openai": Profile(length_field="max_completion_tokens", batch=True, needs_key=True, image_tokens=OPENAI),
        # `max_tokens`, a temperature and `stop` are refused with 400; the system role is called `developer`
        "openai-reasoning": Profile(
            length_field="max_completion_tokens",
            system_role="developer",
            temperature=False,
            stop=False,
            batch=True,
            needs_key=True,
            image_tokens=OPENAI_REASONING,
        ),
        "responses": Profile(
            api="responses",
            length_field="max_output_tokens",
            system_roles=("system", "fold"),
            seed=False,
            stop=False,
            effort_field="reasoning.effort",
            batch=True,
            cached_path=("input_tokens_details", "cached_tokens"),
            reasoning_path=("output_tokens_details", "reasoning_tokens"),
            needs_key=True,
            image_tokens=OPENAI_REASONING,
        ),
        "anthropic": Profile(
            api="anthropic",
            system_roles=(),
            seed=False,
            effort_field="output_config.effort",
            batch=True,
            cached_path=("cache_read_input_tokens",),
            reasoning_path=(),
            needs_key=True,
            image_tokens=ANTHROPIC,
        ),
        "gemini": Profile(
            api="gemini",
            length_field="maxOutputTokens",
            system_roles=("system", "fold"),
            effort_field="generationConfig.thinkingConfig",
            cached_path=("cachedContentTokenCount",),
            reasoning_path=("thoughtsTokenCount",),
            needs_key=True,
            image_tokens=GEMINI,
        ),
        "deepseek": Profile(
            effort_field="thinking.type",
            json_schema=False,
            cached_path=("prompt_cache_hit_tokens",),
            seed=False,
            needs_key=True,
        ),
        "glm": Profile(effort_field="thinking.type", json_schema=False, seed=False, needs_key=True),
        "qwen": Profile(effort_field="enable_thinking", json_schema=False, needs_key=True),
        "openrouter": Profile(effort_field="reasoning.effort", needs_key=True),
        "vllm": Profile(effort_field="chat_template_kwargs", grammar_field=("structured_outputs", "grammar")),
        "ollama": Profile(),
        "llamacpp": Profile(effort_field="chat_template_kwargs", grammar_field=("grammar",)),
        "litellm": Profile(),
        "scripted": Profile(image_tokens=OPENAI),
        "compatible": Profile(),
    }
)
