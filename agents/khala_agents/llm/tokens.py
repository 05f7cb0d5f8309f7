"""The tokens that an endpoint of OpenAI's chat completions tells, for training on what was said.

A model file asks for them under `extra`; nothing here is asked for by itself, since answers get much longer:

    extra: {logprobs: true}                            log-probabilities: OpenAI and most servers
    extra: {logprobs: true, return_token_ids: true}    vLLM: the ids of the prompt and of the answer as well

What is not as it should be is left out: the text of an answer never depends on it.
"""

from __future__ import annotations

import math
from typing import Any, Final

from khala_protocol.messages import MOST, TokenTrace

NEVER: Final = -9999.0
"""Log-probability of a token that could not be: JSON has no infinity. It is vLLM's number."""
_AS_ID: Final = "token_id:"
"""Stands before the number where vLLM's `return_tokens_as_token_ids` has an id in the place of a token's text."""


def token_trace(prompt_ids: Any, reply_ids: Any, logprobs: Any) -> TokenTrace | None:
    """Return what an answer tells of its tokens; None if that is nothing.

    Args:
        prompt_ids: `prompt_token_ids` of the answer.
        reply_ids: `token_ids` of its choice.
        logprobs: of its choice, `{"content": [{"token": …, "logprob": …}, …]}`.
    """
    entries = logprobs.get("content") if isinstance(logprobs, dict) else None
    told = entries if isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries) else []
    trace = TokenTrace(
        prompt_ids=_ids(prompt_ids),
        reply_ids=_ids(reply_ids) or _ids([_id_of(entry.get("token")) for entry in told]),
        logprobs=_numbers([entry.get("logprob") for entry in told]),
    )
    return trace if trace != TokenTrace() else None


def _ids(values: Any) -> tuple[int, ...]:
    """Return ids, or none if any of them is not one."""
    good = isinstance(values, list) and all(type(value) is int and 0 <= value <= MOST for value in values)
    return tuple(values) if good else ()


def _id_of(token: object) -> int | None:
    digits = token.removeprefix(_AS_ID) if isinstance(token, str) and token.startswith(_AS_ID) else ""
    return int(digits) if digits.isdecimal() and len(digits) <= len(str(MOST)) else None


def _numbers(values: list[Any]) -> tuple[float, ...]:
    """Return log-probabilities, or none if any of them is not one."""
    if not all(isinstance(value, int | float) and not math.isnan(value) for value in values):
        return ()
    return tuple(max(float(value), NEVER) if value < math.inf else 0.0 for value in values)
