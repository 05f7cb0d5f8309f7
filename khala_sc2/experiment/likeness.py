"""Whether two selections of matches may be compared: which fields of their run cards differ, and how."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from khala_sc2.experiment.played import PlayedMatch

FIELDS = ("map", "game", "opponent", "executor", "clock", "actions", "code", "versions", "hardware", "task")
"""The names that `khala_sc2.experiment.store.comparable` and `--allow` have."""
SHOWN = 3
"""Values of a field that are named on each side."""
LONGEST = 60
"""Characters of a value that are shown."""
SHA256 = re.compile(r"\b([0-9a-f]{12})[0-9a-f]{52}\b")


@dataclass(frozen=True, slots=True)
class CardDifference:
    """A field in which matches differ."""

    field: str
    """With its place: `clock.max_wait_s`."""
    a: tuple[str, ...]
    """Its values in the first selection."""
    b: tuple[str, ...]

    def __str__(self) -> str:
        if set(self.a) == set(self.b):
            return f"{self.field} is mixed, {_listing(self.a)}"
        return f"{self.field} is {_listing(self.a)} in A, {_listing(self.b)} in B"


def differences(
    a: Iterable[PlayedMatch], b: Iterable[PlayedMatch], fields: Collection[str] = FIELDS
) -> list[CardDifference]:
    """Return in which fields matches differ that should be alike; nothing if all have one value."""
    cards_a, cards_b = ([match.card for match in matches] for matches in (a, b))
    names = [name for name in fields if name != "hardware" or _realtime([*cards_a, *cards_b])]
    return [found for name in names for found in _in_field(name, cards_a, cards_b)]


def forbidden(found: Iterable[CardDifference], allow: Collection[str]) -> list[CardDifference]:
    """Return the differences that are not allowed, by the name of their field or a longer one.

    Raises:
        ConfigError: there is no such field.
    """
    for name in allow:
        if name.partition(".")[0] not in FIELDS:
            raise ConfigError(f"there is no field {name!r}: give one of {', '.join(FIELDS)}", source="--allow")
    return [
        difference for difference in found if not any(f"{difference.field}.".startswith(f"{name}.") for name in allow)
    ]


def _realtime(cards: Iterable[dict[str, Any]]) -> bool:
    """Return whether the speed of a machine is part of a result."""
    return any((card.get("clock") or {}).get("rule") == "realtime" for card in cards)


def _in_field(name: str, a: list[dict[str, Any]], b: list[dict[str, Any]]) -> list[CardDifference]:
    values_a, values_b = (list({_text(card.get(name)): card.get(name) for card in cards}.values()) for cards in (a, b))
    if len({_text(value) for value in (*values_a, *values_b)}) < 2:
        return []
    flat_a, flat_b = ([_flat(name, value) for value in values] for values in (values_a, values_b))
    places = dict.fromkeys(place for flat in (*flat_a, *flat_b) for place in flat)
    found = [CardDifference(place, _values(flat_a, place), _values(flat_b, place)) for place in places]
    return [difference for difference in found if len({*difference.a, *difference.b}) > 1]


def _flat(name: str, value: Any) -> dict[str, str]:
    """Return the leaves of a nested value by their places."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if not inner:
        return {name: _text(value)}
    return {place: text for key, item in inner for place, text in _flat(f"{name}.{key}", item).items()}


def _values(flats: list[dict[str, str]], place: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(flat.get(place, "nothing") for flat in flats))


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, sort_keys=True)


def _listing(values: tuple[str, ...]) -> str:
    texts = [SHA256.sub(r"\1", value) for value in values[:SHOWN]]
    words = [text if len(text) <= LONGEST else f"{text[:LONGEST]}…" for text in texts]
    more = f" and {len(values) - SHOWN} more" if len(values) > SHOWN else ""
    return " or ".join(words) + more
