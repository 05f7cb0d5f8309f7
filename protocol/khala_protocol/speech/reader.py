"""One pass over a reply, from mark to mark and never back.

Above it: `khala_protocol.speech`, which lists the rules (S1 to S42). Below: `headings`, `calls`, `arguments`,
`quoting`, `objects` and `tools`, each of which reads one kind of thing at one place, `whole`, which reads a reply
that is JSON as a whole, `echoes`, which knows what repeats the prompt, and `said`, which decides what counts.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from khala_protocol import reasoning
from khala_protocol.messages import MAX_REPLY_CHARACTERS, Call, Rejection
from khala_protocol.speech.arguments import read_arguments
from khala_protocol.speech.calls import (
    FORGET,
    LISTEN_NAMES,
    MESSAGE_NAMES,
    NOTE,
    REVOKE,
    STANDING,
    Opening,
    close_bare,
    close_parentheses,
    closing_tags,
    element_at,
    in_words_at,
    is_markup,
    is_talk,
    loose_arguments,
    naked_at,
    naked_talk_at,
    named_behind,
    opening_at,
    refuse_words,
    segment_end,
    stands_alone,
)
from khala_protocol.speech.echoes import NOTHING_SHOWN, ShownText, has_arguments, is_form
from khala_protocol.speech.headings import (
    JSON_KEY,
    SENTENCE_END,
    Heading,
    ReplySection,
    Tone,
    heading_at,
    json_heading_at,
    tag_heading_at,
)
from khala_protocol.speech.marks import QUOTES, SHORT, MalformedCall, to_ascii, unescape
from khala_protocol.speech.objects import TEAMS, ObjectCall, ObjectMessage, call_of, message_of, object_at
from khala_protocol.speech.quoting import MessageReader
from khala_protocol.speech.said import Forget, Gathering, ListenTo, MessageTo, Note, Revoke, Speech, Standing
from khala_protocol.speech.standing import numbers_in, standing_at
from khala_protocol.speech.tools import BEGINS, item_at, tool_at
from khala_protocol.speech.whole import json_reply_of
from khala_protocol.speech.words import NEGATION

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_protocol.messages import Point
    from khala_protocol.speech.quoting import Addressed
    from khala_protocol.speech.whole import Part

    Said: TypeAlias = Call | MessageTo | ListenTo | Note | Forget | Standing | Revoke


MAX_LINES = 4_000
"""Number of lines that are read, without empty ones: 33 000 of them, as many as fit, would take a third of a second."""

MAX_FOUND = 1_000
"""Number of calls, messages and faults that are read: 9 000 of them, as many as fit, would take a third of a second."""


def parse(text: str, shown: ShownText = NOTHING_SHOWN) -> Speech:
    """Read a reply. Never raise; see the table of `khala_protocol.speech`.

    Args:
        text: the reply.
        shown: what its agent was shown: calls that repeat it are mentions.
    """
    walk = _Walk(text[:MAX_REPLY_CHARACTERS], shown)
    try:
        walk.run()
    except _TooManyError as error:
        return _incomplete(walk, text, error.start, f"the reply has more than {error}")
    if len(text) > MAX_REPLY_CHARACTERS:
        said = f"the reply is longer than {MAX_REPLY_CHARACTERS} characters"
        return _incomplete(walk, text, MAX_REPLY_CHARACTERS, said)
    return walk.gathering.speech()


class _TooManyError(Exception):
    def __init__(self, what: str, start: int) -> None:
        super().__init__(what)
        self.start = start


def _incomplete(walk: _Walk, text: str, start: int, why: str) -> Speech:
    """Return what was read of a reply up to this place, and the rejection of the rest."""
    message = f"{why}, the rest of it was not read: write less"
    unread = Rejection(reason="malformed", message=message, text=text[start : start + SHORT], start=start)
    speech = walk.gathering.speech()
    return replace(speech, faults=(*speech.faults, unread))


_BLOCK_END = re.compile(reasoning.BLOCK_END, re.IGNORECASE)
_SPEAKER = (
    r"<\|(?:im_)?start\|>\s*+user\b|<start_of_turn>\s*+user\b|<\|user\|>|<\|start_header_id\|>\s*+user\b|\[INST\]"
)
_MAY_BEGIN = re.compile(r"[\n<\[◁{`|\"'.!?;。]")
"""First characters of what `_NEXT` matches; a search for one of them is ten times faster."""
_NEXT = re.compile(
    rf"(?P<line>\n\s*+)|(?P<thought>{reasoning.END})|(?P<tool>{BEGINS})|(?P<think>{reasoning.BEGIN})|(?P<comment><!--)"
    rf"|(?P<speaker>{_SPEAKER})"
    r"|(?P<angle><)|(?P<object>\{)|(?P<team>\"teams?\"\s*+:)"
    r"|(?P<quoted>(?:(?<=[\[,:])|(?<=[\[,:] ))[\"'](?=[A-Z]\w*+\()|(?:(?<=:)|(?<=: )|(?<=:\*\* ))`(?=[A-Z]\w*_\w*\()"
    r"|(?<=<\|python_tag)\|>(?=\w))"
    rf"|(?P<sentence>{SENTENCE_END}|{JSON_KEY})",
    re.IGNORECASE,
)
_OBJECT_AHEAD = re.compile(r"[\s\[,]{0,40}+\{")
_OTHER_SPEAKER = re.compile(r"[*_#]*+(?:user|human)[*_]*+:", re.IGNORECASE)
_OBSERVATION = re.compile(r"[*_#> ]*+Game[:*_ ]*+\n\s*+Time: ?[0-9]+:[0-9]{2}")
"""The beginning of an observation: a model that goes on with it makes the next turn up."""
_TEAM_ARGUMENT = re.compile(
    rf"(?:{'|'.join(TEAMS)})\s*+[=:]\s*+[\"'`]?(?P<team>[^\"'`]{{1,60}}+)[\"'`]?", re.IGNORECASE
)
_GENERIC = re.compile(r"[A-Za-z0-9]<")
_NEGATED = re.compile(rf"(?:{NEGATION})[\s`*\"'_]*+$", re.IGNORECASE)
_STRUCK = re.compile(r"~~[\s`*]*+$")
_STRUCK_BEHIND = re.compile(r"[ \t`*]*+~~")
_NO_HEADING = ("<", "\n", "")
_LOOKED_BACK = 24
_OF_WORDS = MESSAGE_NAMES | {NOTE, STANDING}
"""Names of calls whose words are no list of arguments."""
_DIRECTLY_ABOVE = 80
_UNTIL = re.compile(r"(?:until\s+)?(?:revoked?\b.*)?", re.IGNORECASE)
"""What may stand before the end of a standing order, and the end that it has anyway."""


class _Walk:
    def __init__(self, text: str, shown: ShownText) -> None:
        self._text = text
        self._shown = shown
        self._plain = to_ascii(text)
        self._messages = MessageReader(self._plain)
        self._lines = 0
        self._found = 0
        self._start_over()

    def _start_over(self) -> None:
        self.gathering = Gathering()
        self._section = ReplySection.NONE
        self._tone = Tone.DO
        self._echo_end = -1
        self._aside_until = 0
        self._team: str | None = None
        self._team_above_section: str | None = None
        self._team_end = -_DIRECTLY_ABOVE

    def run(self) -> None:
        document = json_reply_of(self._text)
        if document is not None and self._read_json_reply(document.parts):
            return
        at = self._line(0)
        while place := _MAY_BEGIN.search(self._plain, at):
            mark = _NEXT.match(self._plain, place.start())
            at = place.end() if mark is None else _READS[str(mark.lastgroup)](self, mark)

    def _read_json_reply(self, parts: Sequence[Part]) -> bool:  # S41
        """Read a reply that is JSON as a whole; return False if an item of it is something else."""
        read = [(part, found) for part in parts if (found := _of_part(part)) is not None]
        if len(read) < len(parts):
            return False
        for part, found in read:
            self._section = ReplySection.ACTIONS if part.kind == "orders" else ReplySection.COMMUNICATIONS
            if isinstance(found, ObjectCall):
                self._add_object(found, part.start)
            else:
                self._add(found, self._section, part.start)
        self.gathering.headed |= {ReplySection.ACTIONS, ReplySection.COMMUNICATIONS}
        return True

    @cached_property
    def _last_comment_end(self) -> int:
        return self._plain.rfind("-->") + 1

    @cached_property
    def _closing_tags(self) -> frozenset[str]:
        return closing_tags(self._plain)

    # Each of the following reads the thing at one place and returns the offset after it.

    def comment(self, mark: re.Match[str]) -> int:  # S24
        if mark.end() >= self._last_comment_end:
            return mark.end()
        return self._plain.find("-->", mark.end())

    def speaker(self, mark: re.Match[str]) -> int:  # S26
        return len(self._plain) if self.gathering else mark.end()

    def line(self, mark: re.Match[str]) -> int:
        if mark.group().count("\n") > 1:
            self._tone = Tone.DO  # a section of the host ends with an empty line
        return self._line(mark.end())

    def sentence(self, mark: re.Match[str]) -> int:
        return self._headings(mark.end(), line_start=False)

    def object(self, mark: re.Match[str]) -> int:
        end = self._object(mark.start())
        return mark.end() if end is None else self._headings(end, line_start=False)

    def quoted(self, mark: re.Match[str]) -> int:
        return self._read_naked(mark.end()) or mark.end()

    def angle(self, mark: re.Match[str]) -> int:
        return self._angle(mark.start())

    def _line(self, at: int) -> int:
        self._lines += 1
        if self._lines > MAX_LINES:
            raise _TooManyError(f"{MAX_LINES} lines", at)
        if self.gathering and _OTHER_SPEAKER.match(self._plain, at):  # S26
            return len(self._plain)
        if self.gathering.has_orders() and _OBSERVATION.match(self._plain, at):
            return len(self._plain)
        at = self._headings(at, line_start=True)
        if self._section is ReplySection.ACTIONS and (words := in_words_at(self._plain, at)):
            reason = f"a call stands in angle brackets: write <{words['name'][:SHORT]}(...)>"
            self._fault(words.start(), words.end(), words["name"], reason)
            return words.end()
        return at

    def _headings(self, at: int, *, line_start: bool) -> int:
        while self._plain[at : at + 1] not in _NO_HEADING:
            brace = _OBJECT_AHEAD.match(self._plain, at)
            if line_start and self._plain[at] == "-" and (item := item_at(self._plain, at)):  # S38
                self._add_object(item, at)
                return item.end - 1
            if brace and (end := self._object(brace.end() - 1)):
                at = end
            elif heading := heading_at(self._plain, at, line_start=line_start):
                self._enter(heading, at)
                at = heading.end
            else:
                break
            line_start = False
        while self._plain[at : at + 1] not in _NO_HEADING and (naked := self._read_naked(at)):
            at = naked
        return at

    def _enter(self, heading: Heading, at: int) -> None:
        if heading.section and heading.section is ReplySection.ACTIONS and heading.tone is Tone.INSTEAD:
            self.gathering.withdraw_orders(heading.team)
        if heading.explains and self._section is ReplySection.ACTIONS and self.gathering.has_orders():
            line_end = self._plain.find("\n", heading.end)
            rest = self._plain[heading.end : line_end if line_end >= 0 else None]
            if rest.strip("*_#: \t"):
                self._aside_until = heading.end + len(rest)
            else:
                self._section = ReplySection.ANALYSIS
        if heading.section:
            self._echo_end = -1
            self.gathering.open_block(self._plain[at : heading.end])
            if at - self._team_end < _DIRECTLY_ABOVE and not self._plain[self._team_end : at].strip('#*_> \t\n",{['):
                self._team_above_section = self._team  # S14
            elif (self._section, heading.section) != (ReplySection.ANALYSIS, ReplySection.ACTIONS):
                self._team_above_section = None
            self._team = self._team if heading.numbered else self._team_above_section
            self._tone = heading.tone if heading.section is ReplySection.ACTIONS else Tone.DO
            if self._tone in (Tone.SPEAK_OF, Tone.OFFERED, Tone.PAST):
                self._section = ReplySection.ANALYSIS
            else:
                self._section = heading.section
                self.gathering.headed.add(heading.section)
        if heading.names_team:
            self._team = heading.team
            self._team_end = heading.end

    def end_of_thoughts(self, end: re.Match[str]) -> int:  # S9
        self._start_over()
        return self._line(end.end())

    def thoughts(self, begin: re.Match[str]) -> int:
        end = _BLOCK_END.search(self._plain, begin.end())
        if end is not None:
            return self._line(end.end())
        reason = "the reasoning block is not closed, so nothing behind it was carried out: end it with </think>"
        self._section = ReplySection.ACTIONS  # never a mention, in any section
        self._fault(begin.start(), begin.end(), "", reason)
        return len(self._text)

    def tool(self, mark: re.Match[str]) -> int:  # S37
        called = tool_at(self._plain, self._text, mark.start())
        if called is None:
            return mark.end()
        self._add_object(called, mark.start())
        return called.end

    def team(self, mark: re.Match[str]) -> int:
        heading = json_heading_at(self._plain, mark.start())
        if heading is None:
            return mark.end()
        self._enter(heading, mark.start())
        return heading.end

    def _object(self, start: int) -> int | None:
        """Read a call or a message as an object of JSON; return None if there is none at this `{`."""
        found = object_at(self._text, start) or object_at(self._plain, start)  # JSON has escapes of its own
        if found is None:
            return None
        if isinstance(found, ObjectMessage):
            self._add(MessageTo(found.recipient, found.text, start, found.end), ReplySection.COMMUNICATIONS, start)
        else:
            self._add_object(found, start)
        return found.end

    def _add_object(self, called: ObjectCall, start: int) -> None:
        try:
            if is_talk(called.name):
                self._listen(start, called.end, called.name, ", ".join(map(str, called.args)))
            elif called.until is None or called.name.lower() in (FORGET, NOTE, REVOKE, STANDING):
                self._add_call(called.name, called.args, start, called.end, team=called.team)
            else:  # S42
                self._stand(called.name, called.args, called.until, start, called.end, team=called.team)
        except MalformedCall as error:
            self._fault(start, called.end, called.name, str(error))

    def _read_naked(self, at: int) -> int | None:
        """Read a call without angle brackets; return None if there is none."""
        talk = naked_talk_at(self._plain, at)
        naked = naked_at(self._plain, at)
        if (found := talk or naked) is None:
            return None
        start = found.start("call")
        name = found["name"]
        try:
            if talk:
                return self._read_words(name, start, talk.end(), naked=True)
            if not stands_alone(self._plain, found.end()):
                self._fault(start, found.end(), name, f"a call stands in angle brackets: write <{name[:SHORT]}(...)>")
            elif is_talk(name):
                self._listen(start, found.end(), name, found["inside"])
            else:
                team = found["team"] or named_behind(self._plain, found.end())
                self._add_call(name, read_arguments(found["inside"]), start, found.end(), team=team)
            return found.end()
        except MalformedCall as error:
            end = naked.end() if naked else found.end()
            self._fault(start, end, name, str(error))
            return end

    def _angle(self, start: int) -> int:
        if heading := tag_heading_at(self._plain, start):
            self._enter(heading, start)
            return self._headings(heading.end, line_start=False)
        opening = opening_at(self._plain, start)
        if opening is None or (not opening.has_parenthesis and _GENERIC.match(self._plain, start - 1)):  # S7
            return start + 1
        try:
            end = self._call(start, opening)
        except MalformedCall as error:
            if opening.is_call_like:
                self._fault(start, segment_end(self._plain, start), opening.name, str(error))
            return opening.end
        return self._headings(end, line_start=False)

    def _call(self, start: int, opening: Opening) -> int:
        if not opening.has_parenthesis:
            return self._without_parentheses(start, opening)
        name = opening.name
        if name.lower() in _OF_WORDS:
            return self._read_words(name, start, opening.end)
        inner_end, end = close_parentheses(self._plain, opening)
        inside = self._plain[opening.end : inner_end]
        if is_talk(name):
            self._listen(start, end, name, inside)
        else:
            self._add_call(name, read_arguments(inside), start, end)
        return end

    def _without_parentheses(self, start: int, opening: Opening) -> int:
        name = opening.name
        end = close_bare(self._plain, opening.end)
        if name.lower() in MESSAGE_NAMES:
            reader = self._messages
            if found := reader.attributes(opening.end) if end is None else reader.element(end):
                return self._message(start, found)
        if name.lower() == NOTE and end is not None and (noted := self._messages.noted_element(end)):
            return self._note(start, noted)
        found_at = loose_arguments(self._plain, opening.end) if end is None else element_at(self._plain, end, name)
        if found_at and "_" in name and (args := self._typed_arguments(*found_at[:2])):
            self._add_call(name, args, start, found_at[2])
            return found_at[2]
        if end is None:
            refuse_words(self._plain, opening)
        if not is_markup(name, self._closing_tags):
            if is_talk(name):
                self._listen(start, end, name, "")
            else:
                self._add_call(name, (), start, end)
        return end

    def _typed_arguments(self, start: int, stop: int) -> tuple[str | Point, ...]:
        """Return the arguments at this place, if all of them are tags and points; otherwise none."""
        args = read_arguments(self._plain[start:stop])
        return args if all(not isinstance(arg, str) or arg.startswith("0x") for arg in args) else ()

    def _read_words(self, name: str, start: int, at: int, *, naked: bool = False) -> int:
        """Read a message, a note or a standing order, whose words begin at `at`."""
        if name.lower() in MESSAGE_NAMES:
            return self._message(start, self._messages.read(at, naked=naked))
        if name.lower() == NOTE:
            return self._note(start, self._messages.note(at, naked=naked))
        found = standing_at(self._plain, at)
        self._stand(found.name, found.args, found.until, start, found.end)
        return found.end

    def _note(self, start: int, found: Addressed) -> int:
        text = unescape(self._text[found.start : found.stop]).strip(QUOTES + " \t\n")
        self._add(Note(text, start, found.end), ReplySection.NONE, start)
        return found.end

    def _stand(
        self, name: str, args: tuple[str | Point, ...], until: str, start: int, end: int, *, team: str | None = None
    ) -> None:
        call = Call(name=name, args=args, team=team or self._team, start=start, end=end)
        self._add(Standing(call, _UNTIL.sub("", until), start, end), ReplySection.ACTIONS, start)

    def _message(self, start: int, found: Addressed) -> int:
        text = unescape(self._text[found.start : found.stop])
        self._add(MessageTo(found.recipient, text, start, found.end), ReplySection.COMMUNICATIONS, start)
        return found.end

    def _listen(self, start: int, end: int, name: str, inside: str) -> None:
        if name.lower() not in LISTEN_NAMES:
            raise MalformedCall("a message needs a recipient and a text: write <MessageTo(Name, '''text''')>")
        channels = [channel for channel in read_arguments(inside) if isinstance(channel, str)]
        if not channels:
            raise MalformedCall("a channel is missing: write <ListenTo(Name)>")
        for channel in channels:
            self._add(ListenTo(channel.split("=")[-1].strip("\"' "), start, end), ReplySection.COMMUNICATIONS, start)

    def _add_call(
        self, name: str, args: tuple[str | Point, ...], start: int, end: int, *, team: str | None = None
    ) -> None:
        kind = name.lower()
        named = (_TEAM_ARGUMENT.fullmatch(arg) for arg in args if isinstance(arg, str))
        if (own := next(filter(None, named), None)) is not None:
            team = own["team"]
            args = tuple(arg for arg in args if arg != own.string)
        if kind in (FORGET, REVOKE):
            make = Forget if kind == FORGET else Revoke
            for number in numbers_in(args, name):
                self._add(make(number, start, end), ReplySection.NONE, start)
        elif kind == NOTE and args:
            self._add(Note(", ".join(map(str, args)), start, end), ReplySection.NONE, start)
        elif kind == STANDING:
            found = standing_at(", ".join(map(str, args)) + ")", 0)
            self._stand(found.name, found.args, found.until, start, end)
        else:
            call = Call(name=name, args=args, team=team or self._team, start=start, end=end)
            self._add(call, ReplySection.ACTIONS, start)

    def _fault(self, start: int, end: int, name: str, reason: str) -> None:
        self._count(start)
        text = self._text[start : min(end, start + 2 * SHORT)].rstrip()
        fault = Rejection(reason="malformed", message=reason, text=text, start=start, team=self._team)
        kind = ReplySection.COMMUNICATIONS if is_talk(name) else ReplySection.ACTIONS
        self.gathering.add(fault, kind, self._section_at(start), echoed=self._is_echo(start, end))

    def _add(self, item: Said, kind: ReplySection, start: int) -> None:
        self._count(start)
        before = self._plain[max(0, start - _LOOKED_BACK) : start]
        before = before[before.rfind("\n") + 1 :]
        taken_back = False
        if before and not before.isspace():
            struck = _STRUCK.search(before) and _STRUCK_BEHIND.match(self._plain, item.end)
            taken_back = bool(struck or _NEGATED.search(before))
        echoed = self._is_echo(start, item.end)
        self.gathering.add(item, kind, self._section_at(start), taken_back=taken_back, echoed=echoed)

    def _is_echo(self, start: int, end: int) -> bool:
        """Return whether what stands here repeats what the agent was shown (rules E1 to E6)."""
        call = self._plain[start:end]
        names_no_target = is_form(call) or not has_arguments(call)
        ordered = self._section is ReplySection.ACTIONS
        found = (
            self._tone is Tone.PAST
            or (names_no_target and (self._tone is Tone.OFFERED or self._ends_a_quote(start, end)))
            or self._shown.is_echo(self._plain, start, end, ordered=ordered)
        )
        if found:
            self._echo_end = end
        return found

    def _ends_a_quote(self, start: int, end: int) -> bool:
        """Return whether the reply ends here, on the line after an echo: there a quote was cut."""
        if self._echo_end < 0 or self._plain[end : end + SHORT].strip(" \t\n`:"):
            return False
        _, line_end, before = self._plain[self._echo_end : start].partition("\n")
        return bool(line_end) and not before.strip(" \t*_>|-")

    def _count(self, start: int) -> None:
        self._found += 1
        if self._found > MAX_FOUND:
            raise _TooManyError(f"{MAX_FOUND} calls", start)

    def _section_at(self, start: int) -> ReplySection:
        """Return the section at this place."""
        return ReplySection.ANALYSIS if start < self._aside_until else self._section


def _of_part(part: Part) -> Said | ObjectCall | None:
    """Return what an item of a document stands for; None if it is something else."""
    match part.kind, part.content:
        case "orders", dict(content):
            return call_of(content, part.end, in_orders=True)
        case "messages", dict(content):
            if found := message_of(content, part.end):
                return MessageTo(found.recipient, found.text, part.start, found.end)
        case "listen", str(channel):
            return ListenTo(channel.strip(), part.start, part.end)
        case "notes", str(text):
            return Note(text.strip(), part.start, part.end)
        case ("forget" | "revoke") as kind, int(number):
            return (Forget if kind == "forget" else Revoke)(number, part.start, part.end)
    return None


_READS: dict[str, Callable[[_Walk, re.Match[str]], int]] = {
    "line": _Walk.line,
    "sentence": _Walk.sentence,
    "thought": _Walk.end_of_thoughts,
    "think": _Walk.thoughts,
    "tool": _Walk.tool,
    "comment": _Walk.comment,
    "speaker": _Walk.speaker,
    "object": _Walk.object,
    "team": _Walk.team,
    "quoted": _Walk.quoted,
    "angle": _Walk.angle,
}
"""The method for each kind of mark; each returns the offset after what it read."""
