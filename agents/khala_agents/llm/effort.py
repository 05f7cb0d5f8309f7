"""How much a model shall think, as each kind of endpoint is told.

Names with dots are paths: `reasoning.effort` is the field `effort` of the object `reasoning`.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import JsonValue

Effort: TypeAlias = Literal["none", "minimal", "low", "medium", "high", "xhigh", "max"]
"""How much a model thinks before it answers. Each model takes some of the words; `none` switches thinking off."""

EffortField: TypeAlias = Literal[
    "reasoning_effort",
    "reasoning.effort",
    "thinking.type",
    "enable_thinking",
    "chat_template_kwargs",
    "output_config.effort",
    "generationConfig.thinkingConfig",
]
"""The field of a request that says it."""

_BUDGETS: Final[Mapping[Effort, int]] = MappingProxyType({"none": 0, "minimal": 1024, "low": 1024, "medium": 8192})
"""Tokens that Gemini's models before 3 may think: what Google's endpoint for OpenAI's clients makes of the words."""
_MOST_THOUGHTS: Final = 24576
_LEVELS: Final[Mapping[Effort, Effort]] = MappingProxyType({"none": "minimal", "xhigh": "high", "max": "high"})
"""Words that Gemini's models from 3 on do not know, and the nearest that they do. They always think a little."""


def effort_fields(field: EffortField, effort: Effort | None, model: str) -> dict[str, JsonValue]:
    """Return the fields of a request that tell a model how much to think; none for an effort of None."""
    if effort is None:
        return {}
    if field == "output_config.effort" and effort == "none":
        return {"thinking.type": "disabled"}
    return {field: _value(field, effort, model)}


def _value(field: EffortField, effort: Effort, model: str) -> JsonValue:
    thinks = effort != "none"
    match field:
        case "thinking.type":
            return "enabled" if thinks else "disabled"
        case "chat_template_kwargs":  # each template knows one of the two, and ignores the other
            return {"enable_thinking": thinks, "reasoning_effort": effort}
        case "output_config.effort":
            return "low" if effort == "minimal" else effort
        case "generationConfig.thinkingConfig":
            if "gemini-2" not in model:
                return {"thinkingLevel": _LEVELS.get(effort, effort)}
            return {"thinkingBudget": _BUDGETS.get(effort, _MOST_THOUGHTS)}
        case _:
            return thinks if field == "enable_thinking" else effort
