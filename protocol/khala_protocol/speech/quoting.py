"""A message's recipient and text: where quoted words end when they may contain anything.

The text is foreign: it may contain quotes, brackets, line ends and whole calls. It ends where its
quote is followed by `)>`; if its quote is missing, at the `)>` that closes it on the same line. After three quotes,
`>` or a `)` at the line's end is enough. A message without angle brackets ends with a `)` at the end of a line.
Below `khala_protocol.speech.reader`, which knows the purpose of a message.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from khala_protocol.speech.marks import QUOTES, SHORT, MalformedCall

_Q = re.escape(QUOTES)
_MESSAGE = r"<\s*+message_?to\s*+\("
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
_NAKED_MESSAGE = r"\bmessage_?to\("
_NAKED_LINE_END = re.compile(_END_OF_NAKED, re.MULTILINE)
_ELEMENT_END = re.compile(r"</\s*+message_?to\s*+>", re.IGNORECASE)
_ATTRIBUTES = re.compile(
    r"\s++(?:to|name|agent|recipient|receiver|target)\s*+=\s*+\"(?P<to>[^\"<>\n]{1,80}+)\""
    r"\s++(?:text|message|content)\s*+=\s*+\"(?P<text>[^\"<>\n]++)\"\s*+/?+>",
    re.IGNORECASE,
)
_NESTING = re.compile(r"(?P<open><\s*+\w++\()|\)/?+>|\n")
_DEEPEST = 3
_SAMPLE = "write <MessageTo(Name, '''text''')>"

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

    It remembers which quotes are no longer closed in the rest of the text, so that a reply full of
    openings costs one search in total, not one per opening.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._never_closed: set[str] = set()
        self._not_closed_before = 0

    def attributes(self, at: int) -> Addressed | None:
        """Return the message whose recipient and text are attributes after `<MessageTo`."""
        found = _ATTRIBUTES.match(self._text, at)
        return None if found is None else Addressed(found["to"], *found.span("text"), found.end())

    def element(self, at: int) -> Addressed | None:
        """Return the message between `<MessageTo>`, which ends here, and `</MessageTo>`."""
        to = _RECIPIENT.match(self._text, at)
        end = None if to is None or "</" in self._never_closed else _ELEMENT_END.search(self._text, to.end())
        if to is None or end is None:
            self._never_closed.add("</")
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
        quote = _QUOTE.match(self._text, to.end())
        found = quote and self._quoted_end(quote, naked=naked)
        stop, end = found or self._line_end(to.end(), recipient, naked=naked)
        start = quote.end() if quote else to.end()
        if quote and quote.group() not in _ENDS:
            stop = self._before_quotes(start, stop)
        if stop <= start or not self._text[start:stop].strip(QUOTES + " \t\n"):
            raise MalformedCall(f"the message has no text: {_SAMPLE}")
        return Addressed(recipient, start, stop, end)

    def _before_quotes(self, start: int, stop: int) -> int:
        """Return where the words before the quotes end."""
        while stop > start and self._text[stop - 1] in QUOTES:
            stop -= 1
        return stop

    def _quoted_end(self, quote: re.Match[str], *, naked: bool) -> tuple[int, int] | None:
        mark = quote.group()
        kind = mark + "naked" * naked
        if kind in self._never_closed:
            return None
        ends = _NAKED_ENDS if naked else _ENDS
        found = ends[mark if mark in ends else mark[0]].search(self._text, quote.end())
        if found is None:
            self._never_closed.add(kind)
        return (found.start(), found.end()) if found and found["end"] else None

    def _line_end(self, at: int, recipient: str, *, naked: bool) -> tuple[int, int]:
        if naked:
            if at >= self._not_closed_before:
                line_end = self._text.find("\n", at)
                stop = len(self._text) if line_end < 0 else line_end
                if found := _NAKED_LINE_END.search(self._text, at, stop):
                    return found.start(), found.end()
                self._not_closed_before = stop
            raise MalformedCall(f"the message to {recipient[:SHORT]} is not closed: {_SAMPLE}")
        depth = 0
        for mark in _NESTING.finditer(self._text, at):
            if mark["open"] and depth < _DEEPEST:
                depth += 1
            elif mark["open"] or mark.group() == "\n":
                break
            elif depth == 0:
                return self._before_quotes(at, mark.start()), mark.end()
            else:
                depth -= 1
        raise MalformedCall(f"the message to {recipient[:SHORT]} is not closed: end it with ''')>")


def _end_of(mark: str, *, naked: bool = False) -> re.Pattern[str]:
    """Return the end of a text that begins with this quote: the quote and `)>`, or another message that begins so."""
    family = next((f"[{family}]" for family in _FAMILIES if mark in family), mark)
    end = _END_OF_NAKED if naked else _END_OF_THREE if mark in _RUNS[:3] else _END
    message = _NAKED_MESSAGE if naked else _MESSAGE
    flags = re.IGNORECASE | re.MULTILINE
    return re.compile(rf"(?P<end>{family}{end})|{message}[^<>()\n]{{0,160}}?{family}", flags)


_ENDS = {mark: _end_of(mark) for mark in (*_RUNS, *QUOTES)}
_NAKED_ENDS = {mark: _end_of(mark, naked=True) for mark in (*_RUNS, *QUOTES)}
