"""The arguments of a call: text between parentheses ↔ tags, points and words; and a call ↔ its canonical text.

Pure and total: every text gives a tuple or `Malformed`. It knows the *form* of an
argument (hexadecimal is a tag, two numbers are a point) and nothing of what an action wants; whether the
form is the right one, and whether the point lies in its frame, is the business of who knows the catalogue.
Above it: `protocol.speech.reader`, which finds the calls.

| id | rule | written | read as |
|---|---|---|---|
| A1 | hexadecimal is a tag, in lower case, without padding | `0X001002C0001` | `"0x1002c0001"` |
| A2 | quotes, back-ticks and emphasis around an argument are dropped | `'0x1'` | `"0x1"` |
| A3 | a keyword in front of a value is dropped | `tag=0x1`, `Stalker 0x1` | `"0x1"` |
| A4 | brackets around a lone tag are dropped | `[0x1]` | `"0x1"` |
| A5 | two numbers in brackets of any kind are a point | `(3, 4)`, `[ 3 , 4 ]`, `{x: 3, y: 4}`, `[3 4]` | `(3.0, 4.0)` |
| A6 | two neighbouring numbers below 1000 without brackets are a point | `3, 4` | `(3.0, 4.0)` |
| A7 | fractions, exponents and signs are kept | `[-0.5, 1e1]` | `(-0.5, 10.0)` |
| A8 | a comma (or semicolon) too many at the end is dropped | `0x1,` | `"0x1"` |
| A9 | everything else is text, as written | `4295229441`, `[1, 2, 3]`, `0xZZ` | itself |

The 1000 of A6 keeps decimal tags apart from coordinates: a tag is at least 2^18, a frame at most 200 wide.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from protocol.speech.marks import QUOTES, Malformed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from protocol.messages import Call, Point

_PADDING = " \t\n\\*" + QUOTES
_NUMBER = r"[+-]?+(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][+-]?+[0-9]++)?+"
_AXIS = r"(?:[\"']?[xyXY][\"']?\s*+[=:]\s*+)?+"
_POINT = re.compile(rf"[\[({{]\s*+{_AXIS}({_NUMBER})(?:\s*+[,;]\s*+|\s++){_AXIS}({_NUMBER})\s*+[\])}}]")
_LONE_NUMBER = re.compile(_NUMBER)
_TAG = re.compile(r"0[xX]0*+([0-9a-fA-F]*+)(?<=[0-9a-fA-F])")
_KEYWORD = re.compile(r"[A-Za-z_][\w ]{0,30}+[=:]\s*+|[A-Za-z_]\w{0,30}+\s++(?=[0\[({])")
_SEPARATOR_OR_BRACKET = re.compile(r"[,;()\[\]{}]")
_LARGEST_COORDINATE = 1000.0


def read_arguments(text: str) -> tuple[str | Point, ...]:
    """Reads what stands between the parentheses of a call; see the table of the module.

    Raises:
        Malformed: an argument other than the last is empty.
    """
    pieces = [_strip(piece) for piece in _split(text)]
    while pieces and not pieces[-1]:
        pieces.pop()
    if not all(pieces):
        raise Malformed("an argument between two commas is empty: fill it in or leave the comma out")
    return tuple(_join_coordinates([_read_one(piece) for piece in pieces]))


def render(call: Call) -> str:
    """The canonical text of a call, `<Name(0x1002c0001, [3, 4.5])>`.

    `protocol.speech.parse` reads it as the same name and arguments, for every call that it returned.
    """
    return f"<{call.name}({', '.join(_write(argument) for argument in call.args)})>"


def _split(text: str) -> Iterator[str]:
    depth = start = 0
    for match in _SEPARATOR_OR_BRACKET.finditer(text):
        mark = match.group()
        if mark in "([{":
            depth += 1
        elif mark in ")]}":
            depth -= 1
        elif depth == 0:
            yield text[start : match.start()]
            start = match.end()
    yield text[start:]


def _strip(piece: str) -> str:
    return piece.strip(_PADDING)


def _read_one(piece: str) -> str | Point:
    keyword = _KEYWORD.match(piece)
    value = _strip(piece[keyword.end() :]) if keyword else piece
    for form in (value, _strip(value[1:-1])) if value[:1] in ("[", "(", "{") else (value,):
        tag = _TAG.fullmatch(form)
        if tag:
            return "0x" + (tag[1].lower() or "0")
    point = _POINT.fullmatch(value)
    if point:
        x, y = float(point[1]), float(point[2])
        if math.isfinite(x) and math.isfinite(y):
            return x, y
    return value if _LONE_NUMBER.fullmatch(value) else piece


def _join_coordinates(arguments: list[str | Point]) -> Iterator[str | Point]:
    """Rule A6."""
    at = 0
    while at < len(arguments):
        pair = [_coordinate(argument) for argument in arguments[at : at + 2]]
        match pair:
            case [float(x), float(y)]:
                yield x, y
                at += 2
            case _:
                yield arguments[at]
                at += 1


def _coordinate(argument: str | Point) -> float | None:
    if not isinstance(argument, str) or not _LONE_NUMBER.fullmatch(argument):
        return None
    number = float(argument)
    return number if abs(number) < _LARGEST_COORDINATE else None


def _write(argument: str | Point) -> str:
    if isinstance(argument, str):
        return argument
    return "[" + ", ".join(_number(coordinate) for coordinate in argument) + "]"


def _number(value: float) -> str:
    """Shortest text that reads as the same number, without `.0`."""
    return repr(value).removesuffix(".0")
