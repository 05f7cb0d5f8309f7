"""A message's recipient and text: where quoted words end when they may contain anything.

The text is foreign: it may contain quotes, brackets, line ends and whole calls. It ends where its
quote is followed by `)>`; if its quote is missing, at the `)>` that closes it on the same line. After three quotes,
`>` or a `)` at the line's end is enough. A message without angle brackets ends with a `)` at the end of a line.
Below `khala_protocol.speech.reader`, which knows the purpose of a message.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property

from khala_protocol.speech.marks import QUOTES, SHORT, MalformedCall

_Q = re.escape(QUOTES)
_MESSAGE = r"<\s*+(?:message_?to|note)\s*+\("
_RECIPIENT = re.compile(
    r"\s*+(?:(?:to|name|agent|recipient|receiver|target)\s*+[=:]\s*+)?+"
    rf"(?:[{_Q}]{{1,3}}+(?P<quoted>[^{_Q},<>()\n]{{1,80}}+)[{_Q}]{{1,3}}+(?:\s*+[,:;]|\s++(?=[{_Q}]))"
    rf"|(?P<plain>[^{_Q},:;<>()\n]{{1,80}}+)(?:[,:;]|(?=[{_Q}])))"
    r"\s*+(?:(?:text|message|content)\s*+[=:]\s*+)?+",
    re.IGNORECASE,
)
_RUNS = ("'''", '"""', "```", "''", '""', "``")
_CURLED = "[‘’]{3}|[“”]{3}"  # noqa: RUF001 - telling these apart is the point
_QUOTE = re.compile(rf"{'|'.join(_RUNS)}|{_CURLED}|[{_Q}]")
_END = r"\s*+\\?+\)\s*+\\?+/?+>"
_END_OF_THREE = r"\s*+\\?+(?:\)\s*+\\?+/?+>|/?+>|\)[ \t]*+(?=$|<))"
_END_OF_NAKED = r"\s*+\)(?=[ \t`*.,;\]\"'}]*+$)"
_NAKED_MESSAGE = r"\b(?:message_?to|note)\("
_NAKED_LINE_END = re.compile(rf"(?<!\s){_END_OF_NAKED}", re.MULTILINE)
_ELEMENT_END = re.compile(r"</\s*+(?:message_?to|note)\s*+>", re.IGNORECASE)
_KEYWORD = re.compile(r"\s*+(?:(?:text|note|message|content)\s*+[=:]\s*+)?+", re.IGNORECASE)
_ATTRIBUTES = re.compile(
    r"\s++(?:to|name|agent|recipient|receiver|target)\s*+=\s*+\"(?P<to>[^\"<>\n]{1,80}+)\""
    r"\s++(?:text|message|content)\s*+=\s*+\"(?P<text>[^\"<>\n]++)\"\s*+/?+>",
    re.IGNORECASE,
)
_NESTING = re.compile(r"(?P<open><\s*+\w++\()|\)/?+>|\n")
_SAMPLE = "write <MessageTo(Name, '''text''')>"
_SAMPLE_NOTE = "write <Note('''text''')>"

_FAMILIES = ("'´`‘’‚‛‹›", '"“”„‟«»', "「」", "『』")  # noqa: RUF001 - telling these apart is the point


@dataclass(frozen=True, slots=True)
class Addressed:
    """A message as found: `text[start:stop]` is its text, `end` the offset after its `>`."""

    recipient: str
    start: int
    stop: int
    end: int


class MessageReader:
    """A reader of the messages of one reply.

    It remembers how far it searched, so that a reply full of openings costs one search in total, not one per opening.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._searched: dict[re.Pattern[str], tuple[int, re.Match[str] | None]] = {}

    def attributes(self, at: int) -> Addressed | None:
        """Return the message whose recipient and text are attributes after `<MessageTo`."""
        found = _ATTRIBUTES.match(self._text, at)
        return None if found is None else Addressed(found["to"], *found.span("text"), found.end())

    def element(self, at: int) -> Addressed | None:
        """Return the message between `<MessageTo>`, which ends here, and `</MessageTo>`."""
        to = _RECIPIENT.match(self._text, at)
        end = None if to is None else self._search(_ELEMENT_END, to.end())
        if to is None or end is None:
            return None
        start = to.end()
        stop = self._before_quotes(start, end.start())
        while start < stop and self._text[start] in QUOTES:
            start += 1
        recipient = (to["quoted"] or to["plain"]).strip()
        return Addressed(recipient, start, stop, end.end()) if recipient and start < stop else None

    def read(self, at: int, *, naked: bool = False) -> Addressed:
        """Read recipient and text after `<MessageTo(`, or after `MessageTo(` if it is naked.

        Raises:
            MalformedCall: one of them is missing, or the message is not closed.
        """
        to = _RECIPIENT.match(self._text, at)
        recipient = (to["quoted"] or to["plain"]).strip(" \t*_[]{}\\") if to else ""
        if to is None or not recipient:
            raise MalformedCall(f"a message needs a recipient and a text: {_SAMPLE}")
        start, stop, end = self._bounds(to.end(), f"the message to {recipient[:SHORT]}", _SAMPLE, naked=naked)
        return Addressed(recipient, start, stop, end)

    def note(self, at: int, *, naked: bool = False) -> Addressed:
        """Read the text after `<Note(`, or after `Note(` if it is naked; it has no recipient.

        Raises:
            MalformedCall: the text is missing, or not closed.
        """
        keyword = _KEYWORD.match(self._text, at)
        assert keyword is not None, "it matches nothing as well"
        return Addressed("", *self._bounds(keyword.end(), "the note", _SAMPLE_NOTE, naked=naked))

    def noted_element(self, at: int) -> Addressed | None:
        """Return the note between `<Note>`, which ends here, and `</Note>`."""
        end = self._search(_ELEMENT_END, at)
        words = end and self._text[at : end.start()].strip(QUOTES + " \t\n")
        return Addressed("", at, end.start(), end.end()) if end and words else None

    def _bounds(self, at: int, what: str, sample: str, *, naked: bool) -> tuple[int, int, int]:
        """Return where quoted or other words begin and end, and where the call around them ends."""
        quote = _QUOTE.match(self._text, at)
        found = quote and self._quoted_end(quote, naked=naked)
        stop, end = found or self._line_end(at, what, sample, naked=naked)
        start = quote.end() if quote else at
        if quote and quote.group() not in _ENDS:
            stop = self._before_quotes(start, stop)
        if stop <= start or not self._text[start:stop].strip(QUOTES + " \t\n"):
            raise MalformedCall(f"{what.partition(' to ')[0]} has no text: {sample}")
        return start, stop, end

    def _before_quotes(self, start: int, stop: int) -> int:
        """Return where the words before the quotes end."""
        while stop > start and self._text[stop - 1] in QUOTES:
            stop -= 1
        return stop

    def _quoted_end(self, quote: re.Match[str], *, naked: bool) -> tuple[int, int] | None:
        mark = quote.group()
        ends = _NAKED_ENDS if naked else _ENDS
        found = self._search(ends[mark if mark in ends else mark[0]], quote.end())
        return (found.start(), found.end()) if found and found["end"] else None

    def _search(self, pattern: re.Pattern[str], at: int) -> re.Match[str] | None:
        """Return the first match from here on; an earlier search that passed this place has found it."""
        begun, found = self._searched.get(pattern, (len(self._text) + 1, None))
        if at < begun or (found is not None and found.start() < at):
            found = pattern.search(self._text, at)
            self._searched[pattern] = at, found
        return found

    def _line_end(self, at: int, what: str, sample: str, *, naked: bool) -> tuple[int, int]:
        if naked:
            end = self._search(_NAKED_LINE_END, at)
            if end is None or self._text.find("\n", at, end.end()) >= 0:
                raise MalformedCall(f"{what} is not closed: {sample}")
            return end.start(), end.end()
        marks, closes = self._nesting
        closing = closes[bisect_left(marks, at, key=re.Match.start)]
        if closing == len(marks):
            raise MalformedCall(f"{what} is not closed: end it with ''')>")
        return self._before_quotes(at, marks[closing].start()), marks[closing].end()

    @cached_property
    def _nesting(self) -> tuple[list[re.Match[str]], list[int]]:
        """The marks of calls and line ends, and the number of the mark that closes a call whose next mark is this one.

        A number that no mark has says that the call is not closed on its line.
        """
        marks = list(_NESTING.finditer(self._text))
        never = len(marks)
        closes = [never] * (never + 1)
        for place in range(never - 1, -1, -1):
            if marks[place]["open"]:
                inner = closes[place + 1]
                closes[place] = closes[inner + 1] if inner < never else never
            elif marks[place].group() != "\n":
                closes[place] = place
        return marks, closes


def _end_of(mark: str, *, naked: bool = False) -> re.Pattern[str]:
    """Return the end of a text that begins with this quote: the quote and `)>`, or another message that begins so."""
    family = next((f"[{family}]" for family in _FAMILIES if mark in family), mark)
    end = _END_OF_NAKED if naked else _END_OF_THREE if mark in _RUNS[:3] else _END
    message = _NAKED_MESSAGE if naked else _MESSAGE
    flags = re.IGNORECASE | re.MULTILINE
    return re.compile(rf"(?P<end>{family}{end})|{message}[^<>()\n]{{0,160}}?{family}", flags)


_ENDS = {mark: _end_of(mark) for mark in (*_RUNS, *QUOTES)}
_NAKED_ENDS = {mark: _end_of(mark, naked=True) for mark in (*_RUNS, *QUOTES)}
