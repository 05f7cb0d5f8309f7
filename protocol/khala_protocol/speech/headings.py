"""Headings of a reply: lines that open a section or speak for a team, whatever markup is around them.

Pure regular expressions over text of `khala_protocol.speech.marks.to_ascii`. It only finds headings:
`khala_protocol.speech.reader` decides what a section means for the calls in it, and only the bridge knows whether a
team exists.

| id | rule | written |
|---|---|---|
| H1 | headings in any case, singular or plural | `ACTIONS:`, `action:`, `Communication:` |
| H2 | markup, numbers, quotes and emoji around a heading | `**Actions**:`, `### 2. Actions:`, `> _Actions_:` |
| H3 | a section needs no colon if nothing else stands on its line | `### Actions` |
| H4 | words around a section's name | `Our Actions:`, `Action 1:`, `Actions (at most 3):`, `Actions for A:` |
| H5 | a section written as a tag | `<Actions>` |
| H6 | a section in the middle of a line, behind a sentence, a heading or a call | `They are weak. Actions: <Stop()>` |
| H7 | a team with the word Team, in any case, with blanks and markup | `team stalker-1 :`, `Team: A` |
| H8 | a team heading needs no colon if nothing but a call follows | `#### Team Stalker-1`, `Team A -> <Stop()>` |
| H9 | a team without the word Team: one word and a colon, then nothing or a call | `- Stalker-1: <Stop()>` |
| H10 | a remark in brackets behind a team's name is dropped | `Team Stalker-1 (2 units):` |
| H11 | a team written as a tag | `<Team Stalker-1>`, `<team name="Stalker-1">`, `<Stalker-1>` |
| H12 | several teams at once are one team of that name: the bridge splits it | `Team A, B:` |
| H13 | the word Team without a name is a heading of no team | `Team:` |
| H14 | words that open a sentence are no team | `Note:`, `Reasoning:`, `Then:` |
| H15 | a bare name with a number needs no colon: before a call, alone, in a table | `Stalker-1 → <Stop()>` |
| H16 | the word Team behind the name, and "for" before it | `Stalker-1 team:`, `For Team A:` |
| H17 | sections and teams in other languages, also two at once | `Aktionen:`, `动作/Actions:`, `小队 A:` |
| H18 | actions that are only mentioned, and actions that replace earlier ones | `Valid actions:`, `Final actions:` |
| H19 | an explanation or notes behind the actions belong to the analysis | `Explanation: <Stop()>?`, `## Notes` |
| H20 | a team named in a sentence right before a call | `Team A should <Stop()>`, `A-1 will now <Stop()>` |
| H21 | a team as a value of JSON | `"team": "Stalker-1"` |
| H22 | other headings of an observation: calls below them are nobody's orders | `Your last errors:` |
| H23 | a unit of a team is no team: the bridge refuses it | `Team A-1, unit 0x2:` |
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

from khala_protocol.speech import words
from khala_protocol.speech.marks import QUOTES


class ReplySection(Enum):
    """The section of a reply that contains a call."""

    NONE = "none"
    ANALYSIS = "analysis"
    ACTIONS = "actions"
    COMMUNICATIONS = "communications"


class Tone(Enum):
    """How the calls of a section are meant."""

    DO = "do"
    SPEAK_OF = "speak of"
    """They are drafts, possibilities or examples."""
    OFFERED = "offered"
    """They are what the host says is possible (rule E4)."""
    PAST = "past"
    """They were ordered before (rule E5)."""
    INSTEAD = "instead"
    """They replace those of earlier sections."""


@dataclass(frozen=True, slots=True)
class Heading:
    """One heading; `end` is the offset after it. A heading may open a section, speak for a team, or both."""

    end: int
    section: ReplySection | None = None
    names_team: bool = False
    team: str | None = None
    tone: Tone = Tone.DO
    numbered: bool = False
    """Whether it numbers what it opens, `Action 2:`, so that it continues what is above."""
    explains: bool = False
    """Whether it opens an explanation of the text above, of one line unless it stands alone (rule H19)."""


# Possessive quantifiers (`*+`) keep every expression linear: they never backtrack. Optional groups that
# may fail half way are not possessive: Python before 3.11.5 then goes on from where they failed (gh-106052).
_BULLET = r"(?:\[[xX]\]|[^\w\n<]|_|[0-9]{1,2}+[.)])*+"
_CLOSE = r"(?:[^\w\n<:(]*+\([^()\n<]{0,80}+\))?(?:[^\w\n<:]|_)*+"
_WORD = r"\w[\w.+-]*+"
_LATIN = r"[A-Za-z][A-Za-z0-9_.+-]*+"
_TO_EDGE = r"[^\w\n<]*+(?=<|$|(?-i:[A-Z](?=\w*_)\w*+\(|[A-Z][a-z]*+\(\)))"
_KEYWORD = rf"(?:{words.ANALYSIS}|{words.ACTIONS}|{words.COMMUNICATIONS})(?![^\W_])"
_TEAM_WORD = rf"(?:{words.TEAM})"
_FOR_TEAM = rf"(?:[ \t]+(?:for|of)[ \t]+(?:{_TEAM_WORD}[ \t]+)?(?P<of>{_WORD}))?"
_SECTION = (
    rf"(?:(?:(?:your[ \t]+)?+(?:(?P<speak_of>{words.NOT_TO_DO})|(?P<offered>{words.OFFERED})|(?P<past>{words.PAST}))"
    rf"|(?P<instead>{words.INSTEAD})|my|our|next|chosen|current|team|the)[ \t]+)?"
    rf"(?:(?:{words.ANALYSIS})[ \t]+(?:and|&|\+|/)[ \t]+|(?:{_KEYWORD})[ \t]*[/|][ \t]*)?"
    rf"(?P<section>{_KEYWORD})(?:[ \t]*+(?P<number>[0-9]{{1,2}}+))?{_FOR_TEAM}{_CLOSE}(?::|$)"
)
_GAP = r"(?:(?=[^\w\n<:,&/+]*+[,&/+])[^\w\n<:]*+|[^\w\n<:]++and[^\w\n<:]++)(?:teams?[ \t]+)?+"
_SEVERAL = rf"{_WORD}(?:{_GAP}{_WORD}){{1,8}}+"
_UNIT_OF_TEAM = rf"{_WORD}[ \t]*,?[ \t]*units?[ \t]+{_WORD}"
_SHALL = r"[ \t]+(?:should|shall|will|must|can|to|needs?[ \t]+to)(?:[ \t]+(?:now|then|also|first))?[ \t]*+(?=<)"
_TEAM = (
    rf"(?P<every>{words.EVERY_TEAM}){_CLOSE}:"
    rf"|(?:(?:and|then|und|et|y)[ \t]+)?(?:for[ \t]+)?{_TEAM_WORD}(?:[^\w\n<]*+"
    rf"(?:(?P<team>(?!teams?\b)(?:{_UNIT_OF_TEAM}|{_SEVERAL}|{_WORD}(?:[ \t]+{_WORD}){{0,2}})){_CLOSE}:"
    rf"|(?P<short>{_WORD}){_CLOSE}{_TO_EDGE}|(?P<shall>{_WORD}){_SHALL})|[^\w\n<:]*+:{_TO_EDGE})"
    rf"|(?!(?:my|our|the|this|your)\b)(?P<behind>{_LATIN})(?:{words.TEAM_BEHIND}){_CLOSE}:"
)
_BARE = (
    rf"(?P<bare>[A-Za-z]\w*+(?:[.+-]\w++)*+){_CLOSE}:{_TO_EDGE}"
    rf"|(?P<numbered>[A-Za-z][\w.+-]*(?<=[0-9]))[^\w\n<]*+(?=<)"
    rf"|(?P<cell>[A-Za-z][\w.+-]*(?<=[0-9]))[^\w\n<|]*+\|(?=[^\n<]{{0,200}}<)"
    rf"|(?P<alone>[A-Za-z]\w*-[0-9]++)(?:[^\w\n<:]*+|[ \t*]*[-—–]+[ \t][^\n<:]*+)$"  # noqa: RUF001  # dashes
    rf"|(?P<acts>[A-Za-z]\w*-[0-9]++){_SHALL}"
    rf"|(?P<several>(?=[^\n<:]{{0,200}}[0-9]){_SEVERAL}){_CLOSE}:{_TO_EDGE}"
)
_EXPLAINS = (
    rf"(?P<explains>{words.EXPLANATION})(?![^\W_])[^\w\n<:]*+:"
    rf"|(?P<aside>{words.EXPLANATION}|{words.REMARKS})(?![^\W_])[^\w\n<]*+$"
)
_HOST = rf"(?P<host>{words.HOST_HEADINGS}){_CLOSE}(?::|$)"
_NAMED_BY = ("team", "short", "shall", "every", "behind", "bare", "numbered", "cell", "alone", "acts", "several", "of")
_FLAGS = re.IGNORECASE | re.MULTILINE
_LINE = re.compile(rf"{_BULLET}(?:{_HOST}|{_SECTION}|{_EXPLAINS}|{_TEAM}|{_BARE})", _FLAGS)
_TAG = re.compile(
    rf"<\s*+(?:(?P<section>{_KEYWORD})"
    rf"|team[ \t]+(?:name[ \t]*=[ \t]*)?(?P<quote>[\"']?)(?P<team>{_WORD}(?:[ \t]+{_WORD}){{0,2}}+)(?P=quote)"
    r"|(?P<bare>[A-Za-z]\w*-[0-9]++))\s*+>",
    _FLAGS,
)
_JSON = re.compile(r"\"teams?\"\s*+:\s*+\"(?P<team>[^\"\n<>]{1,60}+)\"", re.IGNORECASE)
_JSON_AHEAD = re.compile(r"[\s{\[,]{0,40}+(?=\"teams?\"\s*+:\s*+\"[^\"\n<>]{1,60}+\")", re.IGNORECASE)
_NO_TEAM = re.compile(
    "also|answer|because|commands?|comments?|decisions?|do|final|finally|first|goal|ideas?|lastly|next|notes?|now|optional|or|orders?|"
    "never|output|plan|priority|reason(?:s|ing)?|reply|response|result|second|so|steps?|strategy|summary|tactics?|targets?|"
    "tasks?|then|therefore|thoughts?|thus|warning|why|assistant|accepted|rejected|refused",
    re.IGNORECASE,
)
_SECTIONS = tuple(
    (section, re.compile(expression, re.IGNORECASE))
    for section, expression in (
        (ReplySection.ANALYSIS, words.ANALYSIS),
        (ReplySection.ACTIONS, words.ACTIONS),
        (ReplySection.COMMUNICATIONS, words.COMMUNICATIONS),
    )
)

SENTENCE_END = rf"(?:[.!?;][ \t]|。)[*_]*+(?={_KEYWORD}[*_]*+:)"
"""Regular expression of the end of a sentence after which a section begins within the line (rule H6)."""
JSON_KEY = rf"(?:(?<=[,{{])|(?<=[,{{] ))\"(?={_KEYWORD}\"[ \t]*+:)"
"""The same where a section is a key of JSON."""


def heading_at(text: str, at: int, *, line_start: bool) -> Heading | None:
    """Return the heading at this place, after markup.

    Args:
        text: the reply.
        at: offset of a line's start, or after a call or another heading.
        line_start: which of the two; within a line a bare name is a team only if no prose word looks like it.
    """
    if json_team := _JSON_AHEAD.match(text, at):
        return json_heading_at(text, json_team.end())
    match = _LINE.match(text, at)
    if match is None:
        return None
    if not line_start and ":" not in match.group() and text[match.end() : match.end() + 1] != "<":
        return None  # "<Stop()> after this analysis" ends a sentence and opens nothing
    found = match.groupdict()
    if found["bare"] is not None and not _may_be_team(found["bare"], line_start=line_start):
        return None
    if found["alone"] is not None and not line_start:
        return None
    name = next((found[group] for group in _NAMED_BY if found[group] is not None), None)
    section = ReplySection.ACTIONS if found["host"] else _section(found["section"])
    explains = bool(found["explains"] or found["aside"])
    return Heading(
        end=match.end(),
        section=section,
        names_team=not explains and (section is None or name is not None),
        team=_clean(name),
        tone=_tone(found) if section else Tone.DO,
        numbered=found["number"] is not None,
        explains=explains,
    )


def _tone(found: dict[str, str | None]) -> Tone:
    if found["instead"]:
        return Tone.INSTEAD
    if found["host"]:
        return Tone.PAST
    if found["speak_of"]:
        return Tone.SPEAK_OF
    return Tone.OFFERED if found["offered"] else Tone.PAST if found["past"] else Tone.DO


def json_heading_at(text: str, at: int) -> Heading | None:
    """Return the team here as a value of JSON (rule H21)."""
    match = _JSON.match(text, at)
    return None if match is None else Heading(match.end(), names_team=True, team=_clean(match["team"]))


def tag_heading_at(text: str, at: int) -> Heading | None:
    """Return the heading written as a tag at this `<`."""
    match = _TAG.match(text, at)
    if match is None:
        return None
    team = match["team"] or match["bare"]
    return Heading(match.end(), _section(match["section"]), team is not None, _clean(team))


def _may_be_team(word: str, *, line_start: bool) -> bool:
    return (line_start or not word.isalpha()) and not _NO_TEAM.fullmatch(word)


def _section(word: str | None) -> ReplySection | None:
    if word is None:
        return None
    return next(section for section, expression in _SECTIONS if expression.fullmatch(word))


def _clean(name: str | None) -> str | None:
    """Return the name without quotes, and without the word "actions" after it."""
    if name is None:
        return None
    parts = name.strip(QUOTES + " \t_").split()
    if len(parts) > 1 and parts[-1].lower() in ("action", "actions"):
        parts.pop()
    if len(parts) > 1 and parts[0].lower() == "team":
        del parts[0]
    return " ".join(parts)
