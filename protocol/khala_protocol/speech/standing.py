"""A standing order: the call in it, and the words that say when it ends.

    <Standing(Train_Probe(), until 22 Probe)>
    <Standing(<Hold_Position()>, until attacked)>

What the words of the end mean is decided by the host. Above it: `khala_protocol.speech.reader`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_protocol.speech.arguments import read_arguments
from khala_protocol.speech.marks import QUOTES, MalformedCall

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_protocol.messages import Point

_Q = re.escape(QUOTES)
_INSIDE = r"\s*+\((?P<args>[^()<>\n]*+(?:\([^()<>\n]*+\)[^()<>\n]*+)*+)\)"
_STANDING = re.compile(
    rf"[\s{_Q}]*+(?:<\s*+)?(?P<name>[A-Za-z]\w*+)(?:{_INSIDE})?[\s{_Q}]*+(?:/?\s*+>)?"
    rf"(?:[\s{_Q}]*+[,;][\s{_Q}]*+(?:until\b)?[\s=:]*+(?P<until>[^()<>\n]{{0,80}}+))?\s*+\)\s*+/?>?",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"([0-9]{1,6}+)(?:\.0)?$")
_SAMPLE = "write <Standing(Name(arguments), until 4:30)>"


@dataclass(frozen=True, slots=True)
class StandingCall:
    """A standing order as found: its call, its end in words, and the offset after it."""

    name: str
    args: tuple[str | Point, ...]
    until: str
    end: int


def standing_at(text: str, at: int) -> StandingCall:
    """Return the standing order whose call begins here, after `<Standing(`.

    Raises:
        MalformedCall: there is no call, or it is not closed.
    """
    found = _STANDING.match(text, at)
    if found is None:
        raise MalformedCall(f"a standing order needs a call, and may have an end: {_SAMPLE}")
    until = (found["until"] or "").strip(QUOTES + " \t.")
    return StandingCall(found["name"], read_arguments(found["args"] or ""), until, found.end())


def numbers_in(args: Iterable[str | Point], name: str) -> tuple[int, ...]:
    """Return the numbers that `<Forget(2)>` or `<Revoke(1, 3)>` names.

    Raises:
        MalformedCall: there is none.
    """
    words = (str(part) for arg in args for part in (arg if isinstance(arg, tuple) else (arg,)))
    found = tuple(int(number[1]) for word in words if (number := _NUMBER.search(word)))
    if not found:
        raise MalformedCall(f"the number is missing, as it is listed: write <{name}(1)>")
    return found
