"""A reply that is one object of JSON as a whole: the form that `answer: json` asks models for.

    {
      "analysis": "Two Zerglings are in reach.",
      "orders": [
        {"team": "Stalker-1", "action": "Attack_Unit", "tag": "0x1008c0001"},
        {"team": "Nexus-1", "action": "Train_Probe", "until": "22 Probe"}
      ],
      "messages": [{"to": "Commander", "text": "two Roaches"}],
      "listen": ["Channel-2"], "notes": ["their base is at [20, 9]"], "forget": [1], "revoke": [2]
    }

The keys say what is meant, so that nothing in the analysis or in a message can pass for an order. A text that is not
such an object as a whole, one that was cut among them, is read from mark to mark instead, as any other.
Above it: `khala_protocol.speech.reader`.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from khala_protocol.reasoning import END, FINAL

Kind: TypeAlias = Literal["orders", "messages", "listen", "notes", "forget", "revoke"]

_BEGIN = re.compile(rf"(?:.*(?:{END}|{FINAL}))?\s*(?:```(?:json)?\s*)?(?=\{{)", re.DOTALL | re.IGNORECASE)
_END = re.compile(r"\s*(?:```)?\s*")
_BLANK = re.compile(r"\s*")
_DECODER = json.JSONDecoder()
_KINDS: Final[dict[str, Kind]] = {
    "orders": "orders",
    "actions": "orders",
    "messages": "messages",
    "communications": "messages",
    "listen": "listen",
    "notes": "notes",
    "forget": "forget",
    "revoke": "revoke",
}
_TEXTS = frozenset({"analysis", "thought", "thoughts", "reasoning"})


@dataclass(frozen=True, slots=True)
class Part:
    """One item of a list of the object: its kind, its content, and its place in the reply."""

    kind: Kind
    content: object
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class JsonReply:
    """The content of such an object: its analysis, and the items of its lists."""

    analysis: str
    parts: tuple[Part, ...]


def json_reply_of(reply: str) -> JsonReply | None:
    """Return the content of a reply that is such an object; None for any other reply."""
    begin = _BEGIN.match(reply)
    if begin is None:
        return None
    try:
        document, end = _read(reply, begin.end())
    except (ValueError, RecursionError):
        return None
    return document if _END.fullmatch(reply, end) else None


def _read(text: str, at: int) -> tuple[JsonReply, int]:
    """Return the content of the object that begins here, and the offset after it.

    Raises:
        ValueError: it is not closed, or has a key that is none of ours.
    """
    analysis = ""
    parts: list[Part] = []
    has_lists = False
    at = _skip(text, at + 1)
    while text[at : at + 1] != "}":
        key, at = _key(text, at)
        if key in _KINDS and text.startswith("[", at):
            has_lists = True
            items, at = _items(text, at, _KINDS[key])
            parts += items
        elif key in _TEXTS:
            value, at = _DECODER.raw_decode(text, at)
            analysis = str(value)
        else:
            raise ValueError
        at = _next(text, at, "}")
    if not has_lists:
        raise ValueError
    return JsonReply(analysis, tuple(parts)), at + 1


def _key(text: str, at: int) -> tuple[str, int]:
    """Return the key of an object that begins here, in lower case, and the offset of its value."""
    key, at = _DECODER.raw_decode(text, at)
    at = _skip(text, at)
    if not isinstance(key, str) or text[at : at + 1] != ":":
        raise ValueError
    return key.casefold(), _skip(text, at + 1)


def _items(text: str, at: int, kind: Kind) -> tuple[list[Part], int]:
    """Return the items of the list that begins here, and the offset after it."""
    items: list[Part] = []
    at = _skip(text, at + 1)
    while text[at : at + 1] != "]":
        item, end = _DECODER.raw_decode(text, at)
        items.append(Part(kind, item, at, end))
        at = _next(text, end, "]")
    return items, at + 1


def _next(text: str, at: int, close: str) -> int:
    """Return the offset of what follows behind a comma, or of the end."""
    at = _skip(text, at)
    if text[at : at + 1] == close:
        return at
    if text[at : at + 1] != ",":
        raise ValueError
    return _skip(text, at + 1)


def _skip(text: str, at: int) -> int:
    blank = _BLANK.match(text, at)
    assert blank is not None
    return blank.end()
