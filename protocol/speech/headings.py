"""Headings of a reply: which line opens a section or speaks for a team, whatever markup stands around it.

Pure regular expressions over text of `protocol.speech.marks.to_ascii`. It finds headings and decides nothing:
what a section means for the calls in it is decided in `protocol.speech.reader`, and whether a team exists is
known to the bridge only.

| id | rule | written |
|---|---|---|
| H1 | headings in any case, singular or plural | `ACTIONS:`, `action:`, `Communication:` |
| H2 | markup, numbers, quotes and emoji around a heading | `**Actions**:`, `### 2. Actions:`, `> _Actions_:` |
| H3 | a section needs no colon if nothing else stands on its line | `### Actions` |
| H4 | words around a section's name | `Final Actions:`, `Action 1:`, `Actions (at most 3):`, `Actions for A:` |
| H5 | a section written as a tag | `<Actions>` |
| H6 | a section in the middle of a line, behind a sentence, a heading or a call | `They are weak. Actions: <Stop()>` |
| H7 | a team with the word Team, in any case, with blanks and markup | `team stalker-1 :`, `Team: A` |
| H8 | a team heading needs no colon if nothing but a call follows | `#### Team Stalker-1`, `Team A -> <Stop()>` |
| H9 | a team without the word Team: one word and a colon, then nothing or a call | `- Stalker-1: <Stop()>` |
| H10 | a remark in brackets behind a team's name is dropped | `Team Stalker-1 (2 units):` |
| H11 | a team written as a tag | `<Team Stalker-1>` |
| H12 | several teams at once are one team of that name: who knows the teams refuses it | `Both teams:`, `Team A, B:` |
| H13 | the word Team without a name is a heading of no team | `Team:` |
| H14 | words that open a sentence are no team | `Note:`, `Reasoning:`, `Then:` |
| H15 | a bare name with a number needs no colon before a call, and may stand in a table | `Stalker-1 → <Stop()>` |
| H16 | the word Team behind the name, and "for" before it | `Stalker-1 team:`, `For Team A:` |
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

from protocol.speech.marks import QUOTES


class Section(Enum):
    """The part of a reply that a call stands in."""

    NONE = "none"
    ANALYSIS = "analysis"
    ACTIONS = "actions"
    COMMUNICATIONS = "communications"


@dataclass(frozen=True, slots=True)
class Heading:
    """One heading; `end` is the offset behind it. A heading may open a section, speak for a team, or both."""

    end: int
    section: Section | None = None
    names_team: bool = False
    team: str | None = None


# Possessive quantifiers (`*+`) keep every expression linear: nothing that was eaten is given back. Optional groups that
# may fail half way are not possessive: Python before 3.11.5 then goes on from where they failed (gh-106052).
_BULLET = r"(?:[^\w\n<]|_|[0-9]{1,2}+[.)])*+"
_CLOSE = r"(?:[^\w\n<:(]*+\([^()\n<]{0,80}+\))?(?:[^\w\n<:]|_)*+"
_WORD = r"\w[\w.+-]*+"
_TO_EDGE = r"[^\w\n<]*+(?=<|$)"
_KEYWORD = r"(?:analysis|actions?|communications?|messages?)(?![^\W_])"
_FOR_TEAM = rf"(?:[ \t]+(?:for|of)[ \t]+(?:team[ \t]+)?(?P<of>{_WORD}))?"
_SECTION = (
    r"(?:(?:final|my|our|next|chosen|team|the)[ \t]+)?(?:analysis[ \t]+(?:and|&|\+|/)[ \t]+)?"
    rf"(?P<section>{_KEYWORD})(?:[ \t]*+[0-9]{{1,2}}+)?{_FOR_TEAM}{_CLOSE}(?::|$)"
)
_GAP = r"(?:(?=[^\w\n<:,&/+]*+[,&/+])[^\w\n<:]*+|[^\w\n<:]++and[^\w\n<:]++)(?:teams?[ \t]+)?+"
_SEVERAL = rf"{_WORD}(?:{_GAP}{_WORD}){{1,8}}+"
_TEAM = (
    rf"(?:for[ \t]+)?+teams?\b(?:[^\w\n<]*+(?:(?P<team>{_SEVERAL}|{_WORD}(?:[ \t]+{_WORD}){{0,2}}){_CLOSE}:"
    rf"|(?P<short>{_WORD}){_CLOSE}{_TO_EDGE})|[^\w\n<:]*+:{_TO_EDGE})"
    rf"|(?P<every>(?:all|both|each|every)[ \t]+(?:\w++[ \t]+)??teams?){_CLOSE}:"
    rf"|(?!(?:my|our|the|this|your)\b)(?P<behind>{_WORD})[ \t]+team{_CLOSE}:"
)
_BARE = (
    rf"(?P<bare>[A-Za-z]\w*+(?:[.+-]\w++)*+){_CLOSE}:{_TO_EDGE}"
    rf"|(?P<numbered>[A-Za-z][\w.+-]*(?<=[0-9]))[^\w\n<]*+(?=<)"
    rf"|(?P<several>(?=[^\n<:]*[0-9]){_SEVERAL}){_CLOSE}:{_TO_EDGE}"
)
_NAMED_BY = ("team", "short", "every", "behind", "bare", "numbered", "several", "of")
_FLAGS = re.IGNORECASE | re.MULTILINE
_LINE = re.compile(rf"{_BULLET}(?:{_SECTION}|{_TEAM}|{_BARE})", _FLAGS)
_TAG = re.compile(
    rf"<\s*+(?:(?P<section>{_KEYWORD})|team[ \t]+(?P<team>{_WORD}(?:[ \t]+{_WORD}){{0,2}}+))\s*+>", _FLAGS
)
_NO_TEAM = re.compile(
    "also|because|comments?|explanation|finally|first|goal|ideas?|lastly|next|notes?|now|optional|or|output|plan|"
    "priority|reason(?:s|ing)?|reply|response|result|second|so|steps?|strategy|summary|tactics?|targets?|tasks?|"
    "then|therefore|thoughts?|thus|warning|why",
    re.IGNORECASE,
)

SENTENCE_END = rf"(?<=[.!?;][ \t])[*_]*+(?={_KEYWORD}[*_]*+:)"
"""Regular expression of a place within a line where a section may begin (rule H6)."""


def heading_at(text: str, at: int, *, line_start: bool) -> Heading | None:
    """The heading that stands at this place, behind markup.

    Args:
        text: the reply.
        at: offset of a line's start, or behind a call or another heading.
        line_start: which of the two; within a line a bare name is a team only if no prose word looks like it.
    """
    match = _LINE.match(text, at)
    if match is None:
        return None
    if not line_start and ":" not in match.group() and text[match.end() : match.end() + 1] != "<":
        return None  # "<Stop()> after this analysis" ends a sentence and opens nothing
    found = match.groupdict()
    if found["bare"] is not None and not _may_be_team(found["bare"], line_start=line_start):
        return None
    name = next((found[group] for group in _NAMED_BY if found[group] is not None), None)
    return Heading(
        end=match.end(),
        section=_section(found["section"]),
        names_team=found["section"] is None or name is not None,
        team=_clean(name),
    )


def tag_heading_at(text: str, at: int) -> Heading | None:
    """The heading written as a tag at this `<`."""
    match = _TAG.match(text, at)
    if match is None:
        return None
    return Heading(match.end(), _section(match["section"]), match["team"] is not None, _clean(match["team"]))


def _may_be_team(word: str, *, line_start: bool) -> bool:
    return (line_start or not word.isalpha()) and not _NO_TEAM.fullmatch(word)


def _section(word: str | None) -> Section | None:
    if word is None:
        return None
    return {"an": Section.ANALYSIS, "ac": Section.ACTIONS}.get(word[:2].lower(), Section.COMMUNICATIONS)


def _clean(name: str | None) -> str | None:
    """The name without quotes, and without the word "actions" behind it."""
    if name is None:
        return None
    words = name.strip(QUOTES + " \t_").split()
    if len(words) > 1 and words[-1].lower() in ("action", "actions"):
        words.pop()
    return " ".join(words)
