"""Marks: the digits of a unit's tag that stand beside it in a picture, and that a reply may use for the tag.

    0x1_0014_0001    the mark is `014`

A tag ends in four digits that are the same for nearly all units of a game (how often the game used the number before).
The three digits before them are the mark, or four if two units on one picture would share three. The pictures draw
marks (`khala_bridge.observe.image.marks`), and `khala_bridge.act` reads them.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

_TAIL = 4
"""Hexadecimal digits at the end of a tag that do not distinguish units."""


class MarkDigits(NamedTuple):
    """The two marks that a tag can have, in hexadecimal digits."""

    three: str
    four: str


def mark_digits(tag: int) -> MarkDigits:
    """Return the marks that a tag can have."""
    digits = f"{tag:x}".zfill(_TAIL + 4)[:-_TAIL]
    return MarkDigits(digits[-3:], digits[-4:])


def marks_of(tags: Iterable[int]) -> dict[int, str]:
    """Return the mark of each tag of one picture; different tags have different marks."""
    digits = {tag: mark_digits(tag) for tag in tags}
    shared = Counter(mark.three for mark in digits.values())
    return {tag: mark.three if shared[mark.three] == 1 else mark.four for tag, mark in digits.items()}
