"""Echoes: parts of a reply that repeat what the agent was shown. They are nobody's orders.

A model that does not know what to say copies its prompt: lines of the list of actions, what became of its last orders,
the form that a refusal proposes. Above it: `khala_protocol.speech.reader`.

| id | an echo is | example |
|---|---|---|
| E1 | a call between words that stood beside it in what was shown | `<Stop()>: Stop moving and firing` |
| E2 | a call behind words that only the host writes | `accepted: A-1 <Stop()>`, `**Rejected**: <Stop()>` |
| E3 | a form where no order stands; all of a list of forms, or of one that was shown | `<Move(screen)>, <Stop()>` |
| E4 | a form, or a call without arguments, under the host's heading of what is possible | `Valid actions` |
| E5 | all calls under its heading of what was ordered | `Your last actions` |
| E6 | a call without arguments on the line after an echo, where the reply was cut | `<Stop()>` |

A call that stands alone in its line is no echo, even where the same was shown: so is an answer written.
"""

from __future__ import annotations

import re
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

FEW_LETTERS: Final = 8
"""Words beside a call with fewer letters say nothing about who wrote them."""
LOOKED_AROUND: Final = 200
"""Characters of a line before and behind a call that are compared."""
ENOUGH: Final = 40
"""Characters of shown words that a reply must repeat; models change or cut the end of a line."""
MANY: Final = 4
"""Calls of a line that make it a list, wherever it stands; a team carries out fewer in a step."""

_CALL = re.compile(r"<\s*+[A-Za-z][\w ]*+(?:\([^<>\n]*\))?\s*+/?>")  # in what the host wrote
_MARKS = re.compile(r"[\s*_`#>|~]++")
_EMPHASIS = re.compile(r"[*_`]++")
_EDGES: Final = " :;,.-–—=→"  # noqa: RUF001  # dashes
_NOTHING: Final = " \t*_`#>|.)-" + "0123456789"
_KEY = re.compile(r"[\s'\"`<>/\\]|\(\)")
_HEADING = re.compile(r"(?:(?:for )?teams? )?[\w.+-]+(?: \([^()]*\))?", re.IGNORECASE)
_ANY = r"(?:Name\((?:arguments|args|actions?)\)|(?:MessageTo\(name,|Note\()\s*+'''text'''\)|ListenTo\(channel\))"
_KIND = r"(?:tag|screen|minimap)\b"
_FORM = re.compile(rf"<\s*+(?:\w++\(\s*+{_KIND}(?:\s*+,\s*+{_KIND})*+\s*+\)|{_ANY})\s*+>?", re.IGNORECASE)
_SAMPLE = re.compile(rf"<\s*+{_ANY}\s*+>?", re.IGNORECASE)
_HOST_WORDS = re.compile(
    r"(?:^|[\s\"'(])"
    r"(?:(?:accepted(?: before)?|rejected|refused|what was possible)\s?+:[^<]{0,60}+"
    r"|(?:write (?:it like|it as)|did you mean)\s*+:?\s*+[\"'`]*+)$",
    re.IGNORECASE,
)


class _Around(NamedTuple):
    before: str
    behind: str


class ShownText:
    """What an agent was shown before it replied; its lines with calls are looked up when a reply has any.

    Args:
        texts: what it was shown.
        earlier: what it was shown before that, and still knows.
    """

    def __init__(self, *texts: str, earlier: ShownText | None = None) -> None:
        self._texts = texts
        self._earlier = earlier

    @cached_property
    def _lines(self) -> list[str]:
        return [line for text in self._texts if "<" in text for line in text.splitlines() if "<" in line]

    @cached_property
    def _around(self) -> dict[str, set[_Around]]:
        """The words beside each call that was shown, by the call."""
        found: dict[str, set[_Around]] = {}
        for line in self._lines:
            for call in _CALL.finditer(line):
                words = _words_around(line, call.start(), call.end())
                if _says_much(words.before) or _says_much(words.behind):
                    found.setdefault(_key(call.group()), set()).add(words)
        return found

    @cached_property
    def lists(self) -> frozenset[str]:
        """Lines with several calls that were shown, now or before, without marks."""
        own = frozenset(_plain(line) for line in self._lines if line.count("<") > 1)
        return own if self._earlier is None else own | self._earlier.lists

    @cached_property
    def _longest_list(self) -> int:
        """The most characters of a line that may repeat a list: reading stays linear in the length of a line."""
        return max(map(len, self.lists), default=-LOOKED_AROUND) + LOOKED_AROUND

    def is_echo(self, text: str, start: int, end: int, *, ordered: bool) -> bool:
        """Return whether `text[start:end]` repeats what was shown (rules E1 to E3).

        Args:
            text: the reply.
            start: where the call begins.
            end: where it ends.
            ordered: whether it stands under a heading of the reply's own that says that its calls are orders.
        """
        line_start, line_end = _line_around(text, start, end)
        line_start, line_end = max(line_start, start - LOOKED_AROUND), min(line_end, end + LOOKED_AROUND)
        before, call, behind = text[line_start:start], text[start:end], text[end:line_end]
        if _SAMPLE.fullmatch(call) or (not ordered and is_form(call)):
            return True
        if _stands_alone(before) and _stands_alone(behind):
            return False
        if _HOST_WORDS.search(_EMPHASIS.sub("", before)) or _lists_forms(text[line_start:line_end]):
            return True
        own = _words_around(text[line_start:line_end], start - line_start, end - line_start)
        cut = line_end == len(text)
        said = any(_is_between(own, shown, cut=cut) for shown in self.words_around(_key(call)))
        return said or self._is_in_list(text, start, end, ordered=ordered)

    def words_around(self, call: str) -> Iterator[_Around]:
        """Yield the words between which a call was shown."""
        yield from self._around.get(call, ())
        if self._earlier is not None:
            yield from self._earlier.words_around(call)

    def _is_in_list(self, text: str, start: int, end: int, *, ordered: bool) -> bool:
        """Return whether the line around a call is a list of calls that was shown, or its beginning in a cut reply."""
        line_start, line_end = _line_around(text, start, end)
        if line_end - line_start > self._longest_list:
            return False
        line = text[line_start:line_end]
        calls = line.count("<")
        if calls <= 1:
            return False
        if calls < MANY and ordered and not _says_much(_plain(line[line.rfind(">") + 1 :])):
            return False
        said = _plain(line)
        return said in self.lists or (line_end == len(text) and any(shown.startswith(said) for shown in self.lists))


NOTHING_SHOWN: Final = ShownText()
"""For a reply of which nobody knows what was shown before."""


def is_form(call: str) -> bool:
    """Return whether a call has kinds of arguments where the arguments belong, as a list of actions has."""
    return _FORM.fullmatch(call) is not None


def has_arguments(call: str) -> bool:
    """Return whether anything stands between the parentheses of a call."""
    return not call.rstrip("> /").endswith("()") and "(" in call


def _line_around(text: str, start: int, end: int) -> tuple[int, int]:
    """Return where the line around a call begins and ends."""
    line_end = text.find("\n", end)
    return text.rfind("\n", 0, start) + 1, line_end if line_end >= 0 else len(text)


def _lists_forms(line: str) -> bool:
    """Return whether a line lists what could be written: forms, and nothing that is filled in."""
    calls = [call.group() for call in _CALL.finditer(line)]
    forms = sum(map(is_form, calls))
    return len(calls) > 1 and forms > 0 and not any(has_arguments(call) and not is_form(call) for call in calls)


def _stands_alone(words: str) -> bool:
    """Return whether words beside a call say nothing."""
    return not words.strip(_NOTHING)


def _words_around(line: str, start: int, end: int) -> _Around:
    """Return the words before and behind a call, up to the calls next to it."""
    before = line[line.rfind(">", 0, start) + 1 : start]
    following = line.find("<", end)
    behind = line[end : following if following >= 0 else None]
    return _Around(_plain(before), _plain(behind))


def _plain(words: str) -> str:
    """Return words without marks, in one case, for a comparison."""
    return _MARKS.sub(" ", words).strip(_EDGES).casefold()


def _key(call: str) -> str:
    return _KEY.sub("", call).casefold()


def _says_much(words: str) -> bool:
    letters = sum(map(str.isalpha, words))
    return letters >= FEW_LETTERS and " " in words and not _HEADING.fullmatch(words)


def _is_between(own: _Around, shown: _Around, *, cut: bool) -> bool:
    """Return whether words around a call repeat those around a shown one; the last ones of a reply may be `cut`."""
    if _says_much(shown.behind) and _repeats(own.behind, shown.behind, cut=cut):
        return True
    return _says_much(shown.before) and own.before.endswith(shown.before[-ENOUGH:])


def _repeats(own: str, shown: str, *, cut: bool) -> bool:
    """Return whether words begin as the shown ones do, or are the beginning of them."""
    return own.startswith(shown[:ENOUGH]) or (shown.startswith(own) and (_says_much(own) or (cut and own != "")))
