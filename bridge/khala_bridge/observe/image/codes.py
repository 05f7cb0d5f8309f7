"""Two letters for each unit type, which fit on a body of 15 pixels: `ST` for a Stalker, `HT` for a High Templar.

One table for all types, so that a code means the same in every picture of every game; a picture's title says in words
what its codes mean.
"""

from __future__ import annotations

import functools
import re
from itertools import chain, combinations, product
from string import ascii_uppercase, digits
from typing import TYPE_CHECKING

from khala_bridge.knowledge import knowledge

if TYPE_CHECKING:
    from collections.abc import Iterator

_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|\d+")


def code_of(unit_type: str) -> str:
    """Return the code of a unit type; `??` for an unknown one."""
    return _codes().get(unit_type, "??")


@functools.cache
def _codes() -> dict[str, str]:
    """Return the code of each type: the most natural free one; types that are played, and short names, choose first."""
    taken: dict[str, str] = {}

    def order(name: str) -> tuple[bool, int, str]:
        known = knowledge()[name]
        return known.race == "neutral" or not known.melee, len(_WORDS.findall(name)), name

    for name in sorted(knowledge(), key=order):
        code = next((code for code in _wishes(name) if code not in taken), None)
        if code is not None:
            taken[code] = name
    return {name: code for code, name in taken.items()}


def _wishes(name: str) -> Iterator[str]:
    """Yield codes for a name: its initials, then its first letter with a later one, then any two of its letters."""
    words = _WORDS.findall(name) or [name]
    letters = [letter for letter in name.upper() if letter.isalnum()]
    initials = words[0][0] + words[1][0] if len(words) > 1 else ""
    first = (letters[0] + letter for letter in letters[1:])
    pairs = ("".join(pair) for pair in combinations(letters, 2))
    rest = ("".join(pair) for pair in product(letters[0], ascii_uppercase + digits))
    for code in chain([initials.upper()] if initials else [], first, pairs, rest):
        if not code[0].isdigit():
            yield code
