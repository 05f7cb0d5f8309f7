"""One pass over a reply, from mark to mark and never back; decides what counts.

Above it: `protocol.speech`, which says the rules (S1 to S20). Below: `headings`, `calls`, `arguments` and
`quoting`, each of which reads one kind of thing at one place.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from protocol.messages import Call, Rejection
from protocol.speech.arguments import read_arguments
from protocol.speech.calls import (
    LISTEN_NAMES,
    MESSAGE_NAMES,
    Opening,
    close_bare,
    close_parentheses,
    closing_tags,
    is_markup,
    is_talk,
    naked_at,
    opening_at,
    refuse_words,
    segment_end,
)
from protocol.speech.headings import SENTENCE_END, Heading, Section, heading_at, tag_heading_at
from protocol.speech.marks import SHORT, Malformed, to_ascii
from protocol.speech.quoting import MessageReader


@dataclass(frozen=True, slots=True)
class MessageTo:
    """Words for another agent, or for everybody on a channel; `reply[start:end]` is the call."""

    recipient: str
    text: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class ListenTo:
    """The wish to hear a channel; `reply[start:end]` is the call."""

    channel: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Speech:
    """What a reply says, in the order of the text.

    Attributes:
        calls: actions to carry out.
        messages: messages to agents or channels.
        listens: channels to listen to.
        faults: what looked like one of these and is none, reason `malformed`.
        mentions: actions that the analysis speaks of and that are not to be carried out (rule S10).
    """

    calls: tuple[Call, ...] = ()
    messages: tuple[MessageTo, ...] = ()
    listens: tuple[ListenTo, ...] = ()
    faults: tuple[Rejection, ...] = ()
    mentions: tuple[Call, ...] = ()


def parse(text: str) -> Speech:
    """Reads a reply. Never raises; see the table of `protocol.speech`."""
    walk = _Walk(text)
    walk.run()
    return walk.speech()


_Item: TypeAlias = Call | MessageTo | ListenTo | Rejection

_THINK = r"(?:<\s*+{slash}\s*+(?:think(?:ing)?|thoughts?|reasoning|reflection|scratchpad)\s*+>|\[{slash}THINK\])"
_THINK_ENDS = re.compile(_THINK.format(slash="/"), re.IGNORECASE)
_NEXT = re.compile(
    rf"(?P<line>\n\s*+)|(?P<thought>{_THINK.format(slash='/')})|(?P<think>{_THINK.format(slash='')})|(?P<angle><)"
    rf"|(?P<sentence>{SENTENCE_END})",
    re.IGNORECASE,
)
_DIRECTLY_ABOVE = 80


class _Walk:
    def __init__(self, text: str) -> None:
        self._text = text
        self._plain = to_ascii(text)
        self._messages = MessageReader(self._plain)
        self._start_over()

    def _start_over(self) -> None:
        self._found: list[tuple[_Item, Section, bool]] = []  # item, section it belongs under, stands in prose
        self._headed: set[Section] = set()
        self._section = Section.NONE
        self._team: str | None = None
        self._team_above_section: str | None = None
        self._team_end = -_DIRECTLY_ABOVE

    def run(self) -> None:
        at = self._headings(0, line_start=True)
        while mark := _NEXT.search(self._plain, at):
            match mark.lastgroup:
                case "line":
                    at = self._headings(mark.end(), line_start=True)
                case "sentence":
                    at = self._headings(mark.end(), line_start=False)
                case "thought":  # S9
                    self._start_over()
                    at = mark.end()
                case "think":
                    at = self._skip_thoughts(mark)
                case _:
                    at = self._angle(mark.start())

    def speech(self) -> Speech:
        said = [item for item, kind, prose in self._found if not (prose and kind in self._headed)]
        mentioned = [item for item, kind, prose in self._found if prose and kind in self._headed]
        return Speech(
            calls=tuple(item for item in said if isinstance(item, Call)),
            messages=tuple(item for item in said if isinstance(item, MessageTo)),
            listens=tuple(item for item in said if isinstance(item, ListenTo)),
            faults=tuple(item for item in said if isinstance(item, Rejection)),
            mentions=tuple(item for item in mentioned if isinstance(item, Call)),
        )

    @cached_property
    def _closing_tags(self) -> frozenset[str]:
        return closing_tags(self._plain)

    # Each of the following takes what stands at one place and returns the offset behind it.

    def _headings(self, at: int, *, line_start: bool) -> int:
        while heading := heading_at(self._plain, at, line_start=line_start):
            self._enter(heading, at)
            at, line_start = heading.end, False
        naked = naked_at(self._plain, at)
        if naked is None:
            return at
        reason = f"a call stands in angle brackets: write <{naked['name'][:SHORT]}(...)>"
        self._fault(naked.start("call"), naked.end(), naked["name"], reason)
        return naked.end()

    def _enter(self, heading: Heading, at: int) -> None:
        if heading.section:
            if at - self._team_end < _DIRECTLY_ABOVE and not self._plain[self._team_end : at].strip("#*_> \t\n"):
                self._team_above_section = self._team  # S14
            elif (self._section, heading.section) != (Section.ANALYSIS, Section.ACTIONS):
                self._team_above_section = None
            self._team = self._team_above_section
            self._section = heading.section
            self._headed.add(heading.section)
        if heading.names_team:
            self._team = heading.team
            self._team_end = heading.end

    def _skip_thoughts(self, begin: re.Match[str]) -> int:
        end = _THINK_ENDS.search(self._plain, begin.end())
        if end is not None:
            return end.end()
        reason = "the reasoning block is not closed, so nothing behind it was carried out: end it with </think>"
        self._section = Section.ACTIONS  # never a mention, wherever it stands
        self._fault(begin.start(), begin.end(), "", reason)
        return len(self._text)

    def _angle(self, start: int) -> int:
        if heading := tag_heading_at(self._plain, start):
            self._enter(heading, start)
            return self._headings(heading.end, line_start=False)
        opening = opening_at(self._plain, start)
        if opening is None:
            return start + 1
        try:
            end = self._call(start, opening)
        except Malformed as error:
            if opening.is_call_like:
                self._fault(start, segment_end(self._plain, start), opening.name, str(error))
            return opening.end
        return self._headings(end, line_start=False)

    def _call(self, start: int, opening: Opening) -> int:
        name, inside = opening.name, ""
        if not opening.has_parenthesis:
            end = close_bare(self._plain, opening.end)
            if end is None:
                refuse_words(self._plain, opening)
            if is_markup(name, self._closing_tags):
                return end
        elif name.lower() in MESSAGE_NAMES:
            return self._message(start, opening.end)
        else:
            inner_end, end = close_parentheses(self._plain, opening.end, name)
            inside = self._plain[opening.end : inner_end]
        if is_talk(name):
            self._listen(start, end, name, inside)
        else:
            call = Call(name=name, args=read_arguments(inside), team=self._team, start=start, end=end)
            self._add(call, Section.ACTIONS)
        return end

    def _message(self, start: int, at: int) -> int:
        found = self._messages.read(at)
        text = self._text[found.start : found.stop].strip()
        self._add(MessageTo(found.recipient, text, start, found.end), Section.COMMUNICATIONS)
        return found.end

    def _listen(self, start: int, end: int, name: str, inside: str) -> None:
        if name.lower() not in LISTEN_NAMES:
            raise Malformed("a message needs a recipient and a text: write <MessageTo(Name, '''text''')>")
        channels = [channel for channel in read_arguments(inside) if isinstance(channel, str)]
        if not channels:
            raise Malformed("a channel is missing: write <ListenTo(Name)>")
        for channel in channels:
            self._add(ListenTo(channel, start, end), Section.COMMUNICATIONS)

    def _fault(self, start: int, end: int, name: str, reason: str) -> None:
        text = self._text[start : min(end, start + 2 * SHORT)].rstrip()
        fault = Rejection(reason="malformed", message=reason, text=text, start=start, team=self._team)
        self._add(fault, Section.COMMUNICATIONS if is_talk(name) else Section.ACTIONS)

    def _add(self, item: _Item, belongs_under: Section) -> None:
        self._found.append((item, belongs_under, self._section in (Section.NONE, Section.ANALYSIS)))
