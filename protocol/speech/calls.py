"""One call at one `<`: its name, where its parentheses close, and whether what is no call looks like one.

Pure regular expressions over text of `protocol.speech.marks.to_ascii`. What the arguments say is read by
`protocol.speech.arguments`, a message's text by `protocol.speech.quoting`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NoReturn

from protocol.speech.marks import SHORT, Malformed

# Possessive quantifiers (`*+`) keep every expression linear: nothing that was eaten is given back. Optional groups that
# may fail half way are not possessive: Python before 3.11.5 then goes on from where they failed (gh-106052).
_NAME = re.compile(r"<(?P<blank>\s*+)(?P<name>[^\W\d](?:\\?+[\w-])*+)(?P<open>\s*+\\?+\()?")
_CLOSE = re.compile(r"\s*+\\?+/?+\s*+\\?+>")
_BRACKET = re.compile(r"[()\[\]{}<>]")
_OPENED_BY = {")": "(", "]": "[", "}": "{"}
_SEGMENT = re.compile(r"[^<>\n]*+>?")
_NAKED = re.compile(
    r"(?:[^\w\n<]|_|[0-9]{1,2}+[.)])*+"
    r"(?P<call>(?P<name>[^\W\d][\w-]*+)\((?P<inside>[^()<>\n]*+(?:\([^()<>\n]*+\)[^()<>\n]*+)*+)\))"
)
_MORE_WORDS = re.compile(r"(?:[ \t]++\w++)++(?=[ \t]*+\()")
_CLOSING_TAG = re.compile(r"</\s*+([^\W\d][\w-]*+)\s*+>")
_HTML = re.compile(
    "a|b|body|br|center|code|div|em|font|h[1-6]|hr|html|i|img|li|ol|p|pre|s|span|strong|su[bp]|table|t[dhr]|u|ul",
    re.IGNORECASE,
)

MESSAGE_NAMES = frozenset({"messageto", "message_to"})
"""Names of the call that sends a message, in lower case."""
LISTEN_NAMES = frozenset({"listento", "listen_to"})
"""Names of the call that listens to a channel, in lower case."""


@dataclass(frozen=True, slots=True)
class Opening:
    """`<Name` or `<Name(`.

    Attributes:
        name: as written, without escapes.
        end: offset behind it.
        has_parenthesis: whether it ends with `(`.
        is_call_like: whether the model most likely meant a call: what follows is a fault if it is none.
    """

    name: str
    end: int
    has_parenthesis: bool
    is_call_like: bool


def opening_at(text: str, at: int) -> Opening | None:
    """The opening of a call at this `<`; None if no name follows."""
    match = _NAME.match(text, at)
    if match is None:
        return None
    name = match["name"].replace("\\", "")
    capital, compound, spaced = name[0].isupper(), "_" in name, bool(match["blank"])
    is_call_like = (capital and compound) if spaced else (capital or compound)
    return Opening(name, match.end(), match["open"] is not None, is_call_like or is_talk(name))


def close_parentheses(text: str, at: int, name: str) -> tuple[int, int]:
    """Where the arguments that begin at `at` end, and where the call ends.

    Raises:
        Malformed: a bracket or the call is not closed before the next `<` or the end of the text.
    """
    opened = ["("]
    for match in _BRACKET.finditer(text, at):
        mark = match.group()
        if mark in "([{":
            opened.append(mark)
        elif mark == "<":
            break
        elif mark == ">" or _OPENED_BY[mark] != opened.pop():
            raise Malformed(
                f"a bracket is not closed before {mark!r}: write <{name[:SHORT]}(...)> and close every bracket"
            )
        elif not opened:
            return match.start(), _close_angle(text, match.end(), name)
    raise Malformed(f"the call is not closed: end it with )> as in <{name[:SHORT]}(...)>")


def refuse_words(text: str, opening: Opening) -> NoReturn:
    """Says what is wrong with a name that neither `(` nor `>` follows.

    Raises:
        Malformed: always.
    """
    more = _MORE_WORDS.match(text, opening.end)
    name = "_".join([opening.name, *(more.group().split() if more else [])])
    raise Malformed(f"the name of a call is one word, its arguments stand in parentheses: write <{name[:SHORT]}(...)>")


def close_bare(text: str, at: int) -> int | None:
    """The offset behind the `>` of a call without parentheses; None if something else follows its name."""
    closing = _CLOSE.match(text, at)
    return closing.end() if closing else None


def naked_at(text: str, at: int) -> re.Match[str] | None:
    """A call without angle brackets, `Name(...)`, that stands here behind markup: groups `call` and `name`."""
    match = _NAKED.match(text, at)
    if match is None:
        return None
    name, inside = match["name"], match["inside"]
    meant = (
        is_talk(name) or "_" in name or (name[0].isupper() and (not inside.strip() or "0x" in inside or "[" in inside))
    )
    return match if meant else None


def is_talk(name: str) -> bool:
    """Whether a call of this name speaks or listens, instead of acting."""
    return name.lower() in MESSAGE_NAMES | LISTEN_NAMES


def is_markup(name: str, closing_tags: frozenset[str]) -> bool:
    """Whether `<name>` is a tag of a markup language and no call without parentheses (rule S7)."""
    if _HTML.fullmatch(name):
        return True
    if name.lower() in closing_tags:
        return name[0].islower() or "_" not in name
    return name[0].islower() and "_" not in name


def closing_tags(text: str) -> frozenset[str]:
    """The names, in lower case, of all `</name>` in a text."""
    return frozenset(match[1].lower() for match in _CLOSING_TAG.finditer(text))


def segment_end(text: str, start: int) -> int:
    """Where the words that began at this `<` end: behind the next `>`, or before a `<` or the line's end."""
    match = _SEGMENT.match(text, start + 1)
    return match.end() if match else start + 1


def _close_angle(text: str, at: int, name: str) -> int:
    closing = _CLOSE.match(text, at)
    if closing is None:
        raise Malformed(f"a '>' is missing behind the ')': write <{name[:SHORT]}(...)>")
    return closing.end()
