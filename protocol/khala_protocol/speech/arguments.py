"""The arguments of a call: text between parentheses ↔ tags, points and words; and a call ↔ its canonical text.

Pure and total: every text gives a tuple or `MalformedCall`. It knows the *form* of an
argument (hexadecimal is a tag, two numbers are a point), not what an action requires; the catalogue decides whether
the form is the right one, and whether the point lies in its frame.
Above it: `khala_protocol.speech.reader`, which finds the calls.

| id | rule | written | read as |
|---|---|---|---|
| A1 | hexadecimal is a tag, in lower case, without padding | `0X001002C0001` | `"0x1002c0001"` |
| A2 | quotes, back-ticks and emphasis around an argument are dropped | `'0x1'` | `"0x1"` |
| A3 | a keyword in front of a value is dropped | `tag=0x1`, `Stalker 0x1` | `"0x1"` |
| A4 | brackets around a lone tag are dropped | `[0x1]` | `"0x1"` |
| A5 | two numbers in brackets of any kind are a point | `(3, 4)`, `[ 3 , 4 ]`, `[[3, 4]]`, `[3 4]` | `(3.0, 4.0)` |
| A6 | two neighbouring numbers below 1000 without brackets are a point | `3, 4`, `3 4` | `(3.0, 4.0)` |
| A7 | fractions, exponents and signs are kept | `[-0.5, 1e1]` | `(-0.5, 10.0)` |
| A8 | a comma (or semicolon) too many at the end is dropped | `0x1,` | `"0x1"` |
| A9 | everything else is text, as written | `4295229441`, `[1, 2, 3]`, `0xZZ` | itself |
| A10 | a remark behind a tag is dropped | `0x1 (Zealot)`, `0x1 - weak`, `0x1 /* weak */` | `"0x1"` |
| A11 | names of axes, also in the other order | `{x: 3, y: 4}`, `y=4, x=3` | `(3.0, 4.0)` |
| A12 | a bracket of a point that is missing or too many | `[3, 4`, `3, 4]` | `(3.0, 4.0)` |
| A13 | a comma left out between tags and points | `0x1 [3, 4]`, `tag="0x1" screen="[3, 4]"` | `"0x1"`, `(3.0, 4.0)` |

The 1000 of A6 keeps decimal tags apart from coordinates: a tag is at least 2^18, a frame at most 200 wide.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from khala_protocol.speech.marks import QUOTES, MalformedCall

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_protocol.messages import Call, Point

_PADDING = " \t\n*$#" + QUOTES
_NUMBER = r"[+-]?+(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][+-]?+[0-9]++)?"
_AXIS = r"[\"']?(?P<{0}>[xyXY])[\"']?\s*+[=:]\s*+"
_APART = r"(?:\s*+[,;]\s*+|\s++)"
_POINT = re.compile(
    rf"[\[({{]\s*+(?:{_AXIS.format('first')})?(?P<one>{_NUMBER}){_APART}"
    rf"(?:{_AXIS.format('second')})?(?P<other>{_NUMBER})\s*+[\])}}]?"
)
_AXES = re.compile(
    rf"(?<!\w){_AXIS.format('first')}(?P<one>{_NUMBER}){_APART}{_AXIS.format('second')}(?P<other>{_NUMBER})"
)
_TWO_NUMBERS = re.compile(r"([+-]?+[0-9]{1,3}+(?:\.[0-9]++)?)\s++([+-]?+[0-9]{1,3}+(?:\.[0-9]++)?)")
_LONE_NUMBER = re.compile(_NUMBER)
_HEX = r"0[xX]0*+[0-9a-fA-F]*+(?<=[0-9a-fA-F])"
_TAG = re.compile(r"0[xX]0*+([0-9a-fA-F]*+)(?<=[0-9a-fA-F])")
_REMARK = re.compile(rf"({_HEX})(?:\s|[(\[{{/#*:-])[\s(\[{{/#*:-]*+[A-Za-z][^0-9\[\]]*+")
_VALUES = re.compile(rf"(?<!\w){_HEX}(?!\w)|{_POINT.pattern}".replace("?P<", "?P<_"))
_BETWEEN_VALUES = re.compile(r"(?:[\s\"']|[A-Za-z_]\w{0,30}+\s*+[=:])*")
_KEYWORD = re.compile(r"[A-Za-z_][\w ]{0,30}+[=:]\s*+|(?:[A-Za-z_]\w{0,30}+\s++){1,3}(?=[0\[({])")
_SEPARATOR_OR_BRACKET = re.compile(r"[,;()\[\]{}]")
_LARGEST_COORDINATE = 1000.0


def read_arguments(text: str) -> tuple[str | Point, ...]:
    """Read the text between the parentheses of a call; see the table of the module.

    Raises:
        MalformedCall: an argument other than the last is empty.
    """
    plain = text.replace("\\", " ")
    if "=" in plain or ":" in plain:
        plain = _AXES.sub(_in_order, plain)
    pieces = [value for piece in _split(plain) for value in _apart(_strip(piece))]
    while pieces and not pieces[-1]:
        pieces.pop()
    if not all(pieces):
        raise MalformedCall("an argument between two commas is empty: fill it in or leave the comma out")
    return tuple(_join_coordinates([_read_one(piece) for piece in pieces]))


def render(call: Call) -> str:
    """Return the canonical text of a call, `<Name(0x1002c0001, [3, 4.5])>`.

    `khala_protocol.speech.parse` reads it as the same name and arguments, for every call that it returned.
    """
    return written(call.name, call.args)


def written(name: str, args: Iterable[str | Point]) -> str:
    """Return the canonical text of a name and arguments."""
    return f"<{name}({', '.join(map(_write, args))})>"


def _split(text: str) -> Iterator[str]:
    depth = start = 0
    for match in _SEPARATOR_OR_BRACKET.finditer(text):
        mark = match.group()
        if mark in "([{":
            depth += 1
        elif mark in ")]}":
            depth = max(depth - 1, 0)  # A12
        elif depth == 0:
            yield text[start : match.start()]
            start = match.end()
    yield text[start:]


def _strip(piece: str) -> str:
    return piece.strip(_PADDING)


def _apart(piece: str) -> list[str]:
    """Return the tags and points of a piece that has several and nothing else (rule A13)."""
    values = list(_VALUES.finditer(piece)) if " " in piece or '"' in piece else []
    if len(values) < len("AB"):
        return [piece]
    edges = [0, *(edge for value in values for edge in value.span()), len(piece)]
    between = (piece[start:stop] for start, stop in zip(edges[::2], edges[1::2], strict=True))
    return [value.group() for value in values] if all(map(_BETWEEN_VALUES.fullmatch, between)) else [piece]


def _read_one(piece: str) -> str | Point:
    keyword = _KEYWORD.match(piece)
    value = _strip(piece[keyword.end() :]) if keyword else piece
    inner = _strip(value[1:-1]) if value[:1] in ("[", "(", "{") else value
    for form in (value, inner):
        if tag := _TAG.fullmatch(form):
            return "0x" + (tag[1].lower() or "0")
        point = _POINT.fullmatch(form)
        if point and (found := _point(point)):
            return found
    if remark := _REMARK.fullmatch(value):
        return _read_one(remark[1])
    if two := _TWO_NUMBERS.fullmatch(value):
        return float(two[1]), float(two[2])
    number = value.rstrip("])} \t")  # A12
    return number if _LONE_NUMBER.fullmatch(number) else piece


def _point(match: re.Match[str]) -> Point | None:
    """Return the point of a match; None if a number is too large to be one."""
    left, right = float(match["one"]), float(match["other"])
    if not (math.isfinite(left) and math.isfinite(right)):
        return None
    swapped = (match["first"] or "x").lower() == "y" and (match["second"] or "y").lower() == "x"
    return (right, left) if swapped else (left, right)


def _in_order(match: re.Match[str]) -> str:
    """Return two named coordinates as a point (rule A11)."""
    left, right = match["one"], match["other"]
    return f"[{right}, {left}]" if match["first"].lower() == "y" else f"[{left}, {right}]"


def _join_coordinates(arguments: list[str | Point]) -> Iterator[str | Point]:
    """Yield the arguments, with neighbouring coordinates joined (rule A6)."""
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
    """Return the shortest text that reads as the same number, without `.0`."""
    return repr(value).removesuffix(".0")
