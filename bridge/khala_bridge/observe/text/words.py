"""Small words of all sections: numbers, points, lists. No section, no unit, no game."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_protocol.messages import Point

INDENT = "    "
INDENT2 = INDENT * 2


@functools.lru_cache(4096)
def n(value: float) -> str:
    """Return a number without needless digits: 12, 12.5."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def tenth(value: float) -> str:
    """Return a number to a tenth: 12, 12.5."""
    return f"{value:.1f}".removesuffix(".0")


def whole(value: float) -> str:
    """Return a whole number that is 0 only for 0: a living unit has at least 1."""
    return str(max(1, round(value)) if value > 0 else 0)


def percent(share: float) -> str:
    """Return a share of one as `62%`."""
    return f"{100 * share:.0f}%"


def point(place: Point) -> str:
    """Return a point as actions take it."""
    return f"[{n(place[0])}, {n(place[1])}]"


def one_line(text: str) -> str:
    """Return a text without line breaks, so that no part of it looks like a heading."""
    return " ".join(text.split())


def count_words(numbers: dict[str, int]) -> str:
    """Return counts in words: `3 Stalker, 1 Zealot`."""
    return ", ".join(f"{count} {what}" for what, count in numbers.items())


def plural(kind: str) -> str:
    """Return the name of a type of unit for several of them: `Zealots`, `Sentries`, `Colossi`."""
    for end, ends in (
        ("ossus", "ossi"),
        ("ry", "ries"),
        ("arva", "arvae"),
        ("Templar", "Templar"),
        ("us", "uses"),
        ("x", "xes"),
    ):
        if kind.endswith(end):
            return kind.removesuffix(end) + ends
    return f"{kind}s"


def under_heading(heading: str, lines: Iterable[str]) -> Iterator[str]:
    """Yield a heading with lines below it; nothing without lines."""
    found = list(lines)
    if found:
        yield f"{INDENT}{heading}"
        yield from (f"{INDENT2}{line}" for line in found)


def minutes(seconds: float) -> str:
    """Return a time as `1:05`."""
    whole_s = int(seconds)
    return f"{whole_s // 60}:{whole_s % 60:02}"


def ago(seconds: float) -> str:
    """Return how long something is past: `1:05 ago`."""
    return f"{minutes(seconds)} ago"
