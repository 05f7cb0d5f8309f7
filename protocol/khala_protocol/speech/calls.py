"""One call at one `<`: its name, where its parentheses close, and whether other text looks like a call.

Pure regular expressions over text of `khala_protocol.speech.marks.to_ascii`. `khala_protocol.speech.arguments` reads
the arguments, `khala_protocol.speech.quoting` a message's text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NoReturn

from khala_protocol.speech.marks import SHORT, MalformedCall

# Possessive quantifiers (`*+`) keep every expression linear: they never backtrack. Optional groups that
# may fail half way are not possessive: Python before 3.11.5 then goes on from where they failed (gh-106052).
_NAME = re.compile(
    r"<(?P<blank>[ \t]*+(?:\n[ \t]*+)?+)[*`]*+(?P<name>[A-Za-z](?:\\?+[\w-])*+)[*`]*+(?P<open>\s*+\\?+\()?"
)
_SPACED = re.compile(r"<(?P<name>[A-Z][\w-]*+(?:[ \t]++[A-Z][\w-]*+){1,4})\s*+\\?+\(")
_CLOSE = re.compile(r"[\s\\)\]}]*+[-=/]?+\s*+\\?+>")
_CLOSE_BARE = re.compile(r"\s*+\\?+/?+\s*+\\?+>")
_LOOSE = re.compile(r"(?:\s*+[:=]\s*+|\s++|(?=[\[{]))(?P<inside>[^<>\n]{1,200}+)\s*+/?+\s*+>")
_ELEMENT = re.compile(r"(?P<inside>[^<>]{1,200}+)</\s*+(?P<name>[\w-]++)\s*+>")
_LINE_ENDS = re.compile(r"[ \t]*+(?:$|[\n<,;.|#]|//|--|- |\()")
_FOR_TEAM = re.compile(
    r"[`*\"']*+[ \t]++for[ \t]++(?:team[ \t]++)?(?P<team>[A-Za-z]\w*-[0-9]++)[.`*]*+[ \t]*+(?=\n|$)", re.IGNORECASE
)
_STANDS_ALONE = re.compile(r"[ \t`*_\"'”’»」\]})>|,;.]*+(?:$|\n|</|#|//|/\*|[-–—:(]|[A-Z]\w*+\()")  # noqa: RUF001  # dashes
_BRACKET = re.compile(r"[()\[\]{}<>]")
_OPENED_BY = {")": "(", "]": "[", "}": "{"}
_SEGMENT = re.compile(r"[^<>\n]*+>?")
_NAKED = re.compile(
    r"(?:[^\w\n<]|_|[0-9]{1,2}+[.)])*+"
    r"(?P<call>(?:print\()?(?:(?P<team>[A-Za-z]\w*-[0-9]++)\.|(?:default_api|functions?|tools?)\.)?"
    r"(?P<name>[^\W\d][\w-]*+)(?:\.call)?"
    r"\((?P<inside>[^()<>\n]*+(?:\([^()<>\n]*+\)[^()<>\n]*+)*+)\))"
)
_NAKED_TALK = re.compile(
    r"(?:[^\w\n<]|_|[0-9]{1,2}+[.)])*+(?P<call>(?P<name>message_?to|note|standing)\((?=[^\s)]))", re.IGNORECASE
)
_PLAIN_LINE = re.compile(r"[^<\n]*+(?!<)")
_IN_WORDS = re.compile(r"\b(?P<name>[A-Z](?=\w*_\w)\w++)[ \t:|=]++(?:0[xX][0-9a-fA-F]++|\[[0-9., \t]++\])")
_MORE_WORDS = re.compile(r"(?:[ \t]++\w++)++(?=[ \t]*+\()")
_CLOSING_TAG = re.compile(r"</\s*+([^\W\d][\w-]*+)\s*+>")
_HTML = re.compile(
    "a|b|body|br|center|code|div|em|font|h[1-6]|hr|html|i|img|li|ol|p|pre|s|span|strong|su[bp]|table|t[dhr]|u|ul"
    "|(?:function|tool)_calls?",
    re.IGNORECASE,
)

MESSAGE_NAMES = frozenset({"messageto", "message_to"})
"""Names of the call that sends a message, in lower case."""
LISTEN_NAMES = frozenset({"listento", "listen_to"})
"""Names of the call that listens to a channel, in lower case."""
NOTE = "note"
"""Name of the call that keeps a note, in lower case; the others of this kind follow."""
STANDING = "standing"
FORGET, REVOKE = "forget", "revoke"


@dataclass(frozen=True, slots=True)
class Opening:
    """`<Name` or `<Name(`.

    Attributes:
        name: as written, without escapes.
        end: offset after it.
        has_parenthesis: whether it ends with `(`.
        is_call_like: whether the model most likely meant a call: if it is not a call, it is a fault.
    """

    name: str
    end: int
    has_parenthesis: bool
    is_call_like: bool


def opening_at(text: str, at: int) -> Opening | None:
    """Return the opening of a call at this `<`; None if no name follows."""
    if spaced := _SPACED.match(text, at):  # S21
        return Opening("_".join(spaced["name"].split()), spaced.end(), has_parenthesis=True, is_call_like=True)
    match = _NAME.match(text, at)
    if match is None:
        return None
    name = match["name"].replace("\\", "")
    capital = name[0].isupper()
    compound = "_" in name
    is_call_like = (capital and compound) if match["blank"] else (capital or compound)
    return Opening(name, match.end(), match["open"] is not None, is_call_like or is_talk(name))


def close_parentheses(text: str, opening: Opening) -> tuple[int, int]:
    """Return where the arguments after an opening end, and where the call ends.

    A bracket that is missing or too many is corrected if a `>` shows where the call ends on its line; a missing `>`, if
    the parentheses are closed and nothing else follows (rule S22).

    Raises:
        MalformedCall: the call is not closed before the next `<` or the end of the text, or its meaning is not
        clear.
    """
    opened = ["("]
    for match in _BRACKET.finditer(text, opening.end):
        mark = match.group()
        if mark in "([{":
            opened.append(mark)
        elif mark == "<":
            break
        elif mark == ">" or _OPENED_BY[mark] != opened[-1]:
            return _mend(text, opening, match)
        else:
            opened.pop()
            if not opened:
                return match.start(), _close_angle(text, match.end(), opening)
    raise MalformedCall(f"the call is not closed: end it with )> as in <{opening.name[:SHORT]}(...)>")


def _mend(text: str, opening: Opening, wrong: re.Match[str]) -> tuple[int, int]:
    """Return the ends of a call whose brackets do not match from here on."""
    closing = _CLOSE.match(text, wrong.start())
    if closing is None or not opening.is_call_like or "\n" in text[opening.end : closing.end()]:
        name = opening.name[:SHORT]
        raise MalformedCall(
            f"a bracket is not closed before {wrong.group()!r}: write <{name}(...)> and close every bracket"
        )
    return wrong.start(), closing.end()


def loose_arguments(text: str, at: int) -> tuple[int, int, int] | None:
    """Return where arguments after a name without parentheses begin and end, and where the call ends."""
    match = _LOOSE.match(text, at)
    if match is None:
        return None
    return match.start("inside"), match.start("inside") + len(match["inside"].rstrip(" \t/")), match.end()


def element_at(text: str, at: int, name: str) -> tuple[int, int, int] | None:
    """Return where arguments between `<Name>` and `</Name>` begin and end, and where the element ends."""
    match = _ELEMENT.match(text, at)
    if match is None or match["name"].lower() != name.lower() or not match["inside"].strip():
        return None
    return match.start("inside"), match.end("inside"), match.end()


def refuse_words(text: str, opening: Opening) -> NoReturn:
    """Raise what is wrong with a name that neither `(` nor `>` follows.

    Raises:
        MalformedCall: always.
    """
    more = _MORE_WORDS.match(text, opening.end)
    name = "_".join([opening.name, *(more.group().split() if more else [])])
    raise MalformedCall(
        f"the name of a call is one word, its arguments stand in parentheses: write <{name[:SHORT]}(...)>"
    )


def close_bare(text: str, at: int) -> int | None:
    """Return the offset after the `>` of a call without parentheses; None if something else follows its name."""
    closing = _CLOSE_BARE.match(text, at)
    return closing.end() if closing else None


def naked_at(text: str, at: int) -> re.Match[str] | None:
    """Match a call without angle brackets, `Name(...)`, here after markup: groups `call`, `name`, `inside`."""
    match = _NAKED.match(text, at)
    if match is None:
        return None
    name, inside = match["name"], match["inside"]
    meant = (
        is_talk(name)
        or name.lower() in (FORGET, REVOKE)
        or "_" in name
        or (name[0].isupper() and (not inside.strip() or "0x" in inside or "[" in inside))
    )
    return match if meant else None


def naked_talk_at(text: str, at: int) -> re.Match[str] | None:
    """Match a message without angle brackets that begins here after markup: groups `call` and `name`."""
    return _NAKED_TALK.match(text, at)


def in_words_at(text: str, at: int) -> re.Match[str] | None:
    """Match a name and its argument without the brackets of a call, on a line without any call: group `name`."""
    line = _PLAIN_LINE.match(text, at)
    return _IN_WORDS.search(text, at, line.end()) if line else None


def stands_alone(text: str, end: int) -> bool:
    """Return whether only marks, a comment or another call follow on the line: then a naked call is meant as one."""
    return _STANDS_ALONE.match(text, end) is not None or named_behind(text, end) is not None


def named_behind(text: str, end: int) -> str | None:
    """Return the team named at the end of the line: `Move_Minimap([20, 32]) for Stalker-1`."""
    named = _FOR_TEAM.match(text, end)
    return named["team"] if named else None


def is_talk(name: str) -> bool:
    """Return whether a call of this name speaks or listens, instead of acting."""
    return name.lower() in MESSAGE_NAMES | LISTEN_NAMES


def is_markup(name: str, closing_tags: frozenset[str]) -> bool:
    """Return whether `<name>` is a tag of a markup language and not a call without parentheses (rule S7)."""
    if _HTML.fullmatch(name):
        return True
    if name.lower() in closing_tags:
        return name[0].islower() or "_" not in name
    return name[0].islower() and "_" not in name


def closing_tags(text: str) -> frozenset[str]:
    """Return the names, in lower case, of all `</name>` in a text."""
    return frozenset(match[1].lower() for match in _CLOSING_TAG.finditer(text))


def segment_end(text: str, start: int) -> int:
    """Return where the words that began at this `<` end: after the next `>`, or before a `<` or the line's end."""
    match = _SEGMENT.match(text, start + 1)
    return match.end() if match else start + 1


def _close_angle(text: str, at: int, opening: Opening) -> int:
    if closing := _CLOSE.match(text, at):
        return closing.end()
    if opening.is_call_like and _LINE_ENDS.match(text, at):  # S22
        return at
    raise MalformedCall(f"a '>' is missing behind the ')': write <{opening.name[:SHORT]}(...)>")
