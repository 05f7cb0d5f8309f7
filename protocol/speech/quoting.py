"""A message's recipient and text: where words between quotes end when they may hold anything.

The text is foreign matter: it may have quotes, brackets, line ends and whole calls in it. It ends where its
quote is followed by `)>`; if its quote is missing, at the `)>` that closes it on the same line.
Below `protocol.speech.reader`, which knows what a message is for.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from protocol.speech.marks import QUOTES, SHORT, Malformed

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
_QUOTE = re.compile(rf"{'|'.join(_RUNS)}|[{_Q}]")
_END = r"\s*+\\?+\)\s*+\\?+/?+>"
_NESTING = re.compile(r"(?P<open><\s*+\w++\()|\)/?+>|\n")
_DEEPEST = 3
_SAMPLE = "write <MessageTo(Name, '''text''')>"

_FAMILIES = ("'´`‘’‚‛‹›", '"“”„‟«»', "「」", "『』")  # noqa: RUF001 - telling these apart is the point


@dataclass(frozen=True, slots=True)
class Addressed:
    """A message as found: `text[start:stop]` is what it says, `end` the offset behind its `>`."""

    recipient: str
    start: int
    stop: int
    end: int


class MessageReader:
    """Reads the messages of one reply.

    It remembers which quotes are not closed any more in the rest of the text, so that a reply full of
    openings costs one search and not one each.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._never_closed: set[str] = set()

    def read(self, at: int) -> Addressed:
        """Reads recipient and text behind `<MessageTo(`.

        Raises:
            Malformed: one of them is missing, or the message is not closed.
        """
        to = _RECIPIENT.match(self._text, at)
        recipient = (to["quoted"] or to["plain"]).strip(" \t*_[]{}\\") if to else ""
        if to is None or not recipient:
            raise Malformed(f"a message needs a recipient and a text: {_SAMPLE}")
        quote = _QUOTE.match(self._text, to.end())
        stop, end = (quote and self._quoted_end(quote)) or self._line_end(to.end(), recipient)
        start = quote.end() if quote else to.end()
        if stop <= start or not self._text[start:stop].strip(QUOTES + " \t\n"):
            raise Malformed(f"the message has no text: {_SAMPLE}")
        return Addressed(recipient, start, stop, end)

    def _quoted_end(self, quote: re.Match[str]) -> tuple[int, int] | None:
        mark = quote.group()
        if mark in self._never_closed:
            return None
        found = _ENDS[mark].search(self._text, quote.end())
        if found is None:
            self._never_closed.add(mark)
        return (found.start(), found.end()) if found and found["end"] else None

    def _line_end(self, at: int, recipient: str) -> tuple[int, int]:
        depth = 0
        for mark in _NESTING.finditer(self._text, at):
            if mark["open"] and depth < _DEEPEST:
                depth += 1
            elif mark["open"] or mark.group() == "\n":
                break
            elif depth == 0:
                stop = mark.start()
                while stop > at and self._text[stop - 1] in QUOTES:
                    stop -= 1
                return stop, mark.end()
            else:
                depth -= 1
        raise Malformed(f"the message to {recipient[:SHORT]} is not closed: end it with ''')>")


def _end_of(mark: str) -> re.Pattern[str]:
    """What ends a text that begins with this quote: the quote and `)>`; or another message that begins the same."""
    family = next((f"[{family}]" for family in _FAMILIES if mark in family), mark)
    return re.compile(rf"(?P<end>{family}{_END})|{_MESSAGE}[^<>()\n]{{0,160}}?{family}", re.IGNORECASE)


_ENDS = {mark: _end_of(mark) for mark in (*_RUNS, *QUOTES)}
