"""How long the texts of rows are, in tokens: of a tokenizer, or estimated."""

from __future__ import annotations

from array import array
from collections import defaultdict
from functools import lru_cache
from importlib import import_module
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from khala_agents.llm.client import estimated_text_tokens
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from khala_sc2.dataset.row import Row

ESTIMATE = "estimated at four bytes a token"
TIKTOKEN = "tiktoken:"
FIELDS = ("system", "example", "earlier steps", "observation", "reply", "row")
"""Parts of a row, in their order, and all of them."""
_MOST_REMEMBERED = 64
"""Texts whose number of tokens is remembered: rows of an episode share the system message and the example."""


class TokenCounter(NamedTuple):
    """Counts the tokens of a text."""

    name: str
    """What counts, for the card."""
    count: Callable[[str], int]


class LengthsOfField(NamedTuple):
    """The lengths of one field over all rows, in tokens."""

    median: int
    p95: int
    longest: int
    share: float
    """Of all tokens of all rows, 0 to 1."""


class Lengths:
    """The lengths of the rows that came so far, field by field.

    Args:
        counter: of tokens.
    """

    def __init__(self, counter: TokenCounter) -> None:
        self.counter = counter
        self._count = lru_cache(_MOST_REMEMBERED)(counter.count)
        self._tokens: dict[str, array[int]] = defaultdict(lambda: array("L"))

    def add(self, row: Row) -> None:
        """Count the texts of a row."""
        first = 1 if len(row.prompt) > 1 else 0
        end = first + row.example
        fields = {
            "system": row.prompt[:first],
            "example": row.prompt[first:end],
            "earlier steps": row.prompt[end:-1],
            "observation": row.prompt[-1:],
        }
        tokens = {name: sum(self._count(part.content) for part in parts) for name, parts in fields.items()}
        tokens["reply"] = self._count(row.reply)
        tokens["row"] = sum(tokens.values())
        for name, number in tokens.items():
            self._tokens[name].append(number)

    def fields(self) -> Mapping[str, LengthsOfField]:
        """Return the lengths of each field that any row has."""
        total = sum(self._tokens["row"])
        return {name: _lengths(sorted(self._tokens[name]), total) for name in FIELDS if any(self._tokens.get(name, ()))}


def _lengths(tokens: list[int], total: int) -> LengthsOfField:
    return LengthsOfField(_at(tokens, 0.5), _at(tokens, 0.95), tokens[-1], sum(tokens) / total)


def _at(ordered: list[int], share: float) -> int:
    """Return the smallest value that is not below this share of all values."""
    return ordered[ceil(share * len(ordered)) - 1]


def token_counter(name: str | None) -> TokenCounter:
    """Return what counts tokens.

    Args:
        name: a file `tokenizer.json`, a name on the Hugging Face hub, or `tiktoken:` and an encoding of it; None for
            Khala's estimate.

    Raises:
        ConfigError: the tokenizer or its package is not there.
    """
    if name is None:
        return TokenCounter(ESTIMATE, estimated_text_tokens)
    return _tiktoken(name) if name.startswith(TIKTOKEN) else _tokenizers(name)


def _tiktoken(name: str) -> TokenCounter:
    tiktoken = _import("tiktoken", "tiktoken")
    try:
        encoding = tiktoken.get_encoding(name.removeprefix(TIKTOKEN))
    except Exception as error:  # noqa: BLE001  # tiktoken raises ValueError, and what its download raises
        raise _no_tokenizer(name, error, "encodings are cl100k_base, o200k_base, …") from None
    return TokenCounter(f"counted by {name}", lambda text: len(encoding.encode(text, disallowed_special=())))


def _tokenizers(name: str) -> TokenCounter:
    tokenizer_class = _import("tokenizers", '"khala-sc2[data]"').Tokenizer
    is_file = Path(name).is_file()
    try:
        tokenizer = tokenizer_class.from_file(name) if is_file else tokenizer_class.from_pretrained(name)
    except Exception as error:  # noqa: BLE001  # the package raises plain exceptions
        advice = "it is no tokenizer.json" if is_file else "it is neither a file nor a name that the hub gives"
        raise _no_tokenizer(name, error, advice) from None
    shown = Path(name).name if is_file else name
    return TokenCounter(f"counted by {shown}", lambda text: len(tokenizer.encode(text, add_special_tokens=False).ids))


def _import(package: str, wanted: str) -> Any:
    try:
        return import_module(package)
    except ImportError:
        raise ConfigError(
            f"needs the package {package}, which is not installed: pip install {wanted}. Without the option, lengths "
            "are estimated",
            source="--tokenizer",
        ) from None


def _no_tokenizer(name: str, error: Exception, advice: str) -> ConfigError:
    return ConfigError(f"'{name}' cannot be loaded, {advice} ({error})", source="--tokenizer")
