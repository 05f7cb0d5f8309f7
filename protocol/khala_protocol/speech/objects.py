"""Calls and messages that are written as JSON: an object that names an action, its arguments and perhaps a team.

    {"team": "Stalker-1", "action": "Attack_Unit", "args": ["0x1008c0001"]}
    {"name": "Move_Screen", "arguments": {"screen": [3, 4]}}
    {"team": "Nexus-1", "action": "Train_Probe", "until": "22 Probe"}
    {"to": "Commander", "text": "two Roaches"}
    {"name": "MessageTo", "arguments": {"to": "Commander", "text": "two Roaches"}}

Models that were trained on tool calls tend to write it. An object counts only if the value for the action is a name,
or a call without angle brackets; any other JSON is read as text. Above it: `khala_protocol.speech.reader`.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_protocol.speech.arguments import read_arguments
from khala_protocol.speech.calls import MESSAGE_NAMES, NOTE
from khala_protocol.speech.marks import MalformedCall

if TYPE_CHECKING:
    from khala_protocol.messages import Point

NAMES = ("action", "name", "function", "command", "tool")
ARGUMENTS = ("args", "arguments", "parameters", "params", "input")
TEAMS = ("team", "team_name", "group")
FIELDS = ("unit", "second_unit", "tag", "screen", "minimap")
"""Names of an action's arguments, in the order of its arguments."""
_PLACES = (*FIELDS, "target", "point", "position", "location")
"""Names of arguments beside the name of an action."""
UNTIL = "until"
"""Name of the end of a standing order."""
RECIPIENTS = ("to", "recipient")
TEXTS = ("text", "message", "content")
LONGEST = 2_000
"""Number of characters of an object that are read."""
_LOOKS_LIKE_ONE = re.compile(
    rf"\{{[^{{}}]{{0,200}}?\"(?:{'|'.join((*NAMES, *RECIPIENTS))})\"\s*+:\s*+[\"{{]", re.IGNORECASE
)
_CALL = re.compile(r"(?P<name>[A-Za-z]\w{0,80}+)(?:\((?P<inside>[^<>]*)\))?")
_DECODER = json.JSONDecoder()


@dataclass(frozen=True, slots=True)
class ObjectCall:
    """A call as an object: its content, and the offset after it."""

    name: str
    args: tuple[str | Point, ...]
    team: str | None
    end: int
    until: str | None = None
    """The end of a standing order; None for an order that is given once."""


@dataclass(frozen=True, slots=True)
class ObjectMessage:
    """A message as an object."""

    recipient: str
    text: str
    end: int


def object_at(text: str, at: int) -> ObjectCall | ObjectMessage | None:
    """Return what the object at this `{` stands for; None if it is neither a call nor a message."""
    if not _LOOKS_LIKE_ONE.match(text, at):
        return None
    decoded = decode_at(text, at)
    if decoded is None:
        return None
    found, end = decoded
    return message_of(found, end) or call_of(found, end)


def decode_at(text: str, at: int) -> tuple[object, int] | None:
    """Return the JSON that begins here, and the offset after it; None if there is none, or a very long one."""
    try:
        found, length = _DECODER.raw_decode(text[at : at + LONGEST])
    except (ValueError, RecursionError):
        return None
    return found, at + length


def message_of(found: object, end: int) -> ObjectMessage | None:
    """Return the message that an object of JSON stands for, which ends here."""
    function = _first(found, NAMES)
    named, inside = (_first(function, NAMES), function) if isinstance(function, dict) else (function, found)
    if isinstance(named, str) and named.lower() in MESSAGE_NAMES:
        found = _as_object(_first(inside, ARGUMENTS))
    to, words = _first(found, RECIPIENTS), _first(found, TEXTS)
    if isinstance(to, str) and isinstance(words, str) and to.strip() and words.strip():
        return ObjectMessage(to.strip(), words.strip(), end)
    return None


def call_of(found: object, end: int, *, in_orders: bool = False) -> ObjectCall | None:
    """Return the call that an object of JSON stands for.

    Args:
        found: the object.
        end: the offset after it.
        in_orders: whether it stands where only orders stand, so that a single word is the name of an action as well.
    """
    named = _first(found, NAMES)
    if isinstance(found, dict) and isinstance(named, dict):  # {"function": {"name": …, "arguments": …}}
        found, named = {**found, **named}, _first(named, NAMES)
    call = _CALL.fullmatch(named.strip()) if isinstance(named, str) else None
    if call is None or not (in_orders or call["inside"] is not None or "_" in call["name"] or _has(found, ARGUMENTS)):
        return None
    given = _as_object(_first(found, ARGUMENTS))
    if given is None and isinstance(found, dict):  # {"action": …, "minimap": [3, 4]}
        given = {key: value for key, value in found.items() if str(key).lower() in _PLACES}
    team = _first(found, TEAMS) or _first(given, TEAMS)
    until = _first(found, (UNTIL,)) or _first(given, (UNTIL,))
    if isinstance(given, dict):
        given = _in_order({key: value for key, value in given.items() if str(key).lower() not in (*TEAMS, UNTIL)})
    try:
        args: tuple[str | Point, ...] = _words(given) if call["name"].lower() == NOTE else ()
        args = args or (read_arguments(call["inside"]) if call["inside"] else tuple(_values(given)))
    except MalformedCall:
        return None
    whose, end_of_it = (value if isinstance(value, str) else None for value in (team, until))
    return ObjectCall(call["name"], args, whose, end, end_of_it)


def _in_order(given: dict[object, object]) -> dict[object, object]:
    """Return named arguments in the order of an action's arguments, where all have the names that Khala gives them."""
    if not set(given) <= set(FIELDS):
        return given
    return {name: given[name] for name in FIELDS if name in given}


def _words(given: object) -> tuple[str, ...]:
    """Return the text of a note, which is no list of arguments."""
    found = given if isinstance(given, str) else _first(given, TEXTS)
    return (found,) if isinstance(found, str) and found.strip() else ()


def _as_object(given: object) -> object:
    """Return arguments in JSON that were written as a string of JSON, as some models write them."""
    return _load(given) if isinstance(given, str) and given.lstrip()[:1] in ("{", "[") else given


def _has(found: object, keys: tuple[str, ...]) -> bool:
    return isinstance(found, dict) and any(key in found for key in keys)


def _first(found: object, keys: tuple[str, ...]) -> object:
    if not isinstance(found, dict):
        return None
    lowered = {str(key).lower(): value for key, value in found.items()}
    return next((lowered[key] for key in keys if key in lowered), None)


def _values(given: object) -> list[str | Point]:
    """Return the arguments in JSON: from a list, an object of named ones, a single one, or text of one of these."""
    match given:
        case None | "":
            return []
        case {"x": x, "y": y}:
            return _values([x, y])
        case dict():
            return _values(list(given.values()))
        case list() if not _is_point(given):
            return [value for item in given for value in _values(item)]
        case _:
            return list(read_arguments(given if isinstance(given, str) else json.dumps(given)))


def _load(given: str) -> object:
    try:
        found = json.loads(given)
    except (ValueError, RecursionError):
        return given.strip("{[ ")
    return found if isinstance(found, dict | list) else given


def _is_point(given: list[object]) -> bool:
    return len(given) == len("xy") and all(isinstance(number, int | float) for number in given)
