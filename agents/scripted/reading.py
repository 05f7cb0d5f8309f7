"""The text of an observation → what a scripted player needs of it. It sees what a model sees, and no more.

The layout is that of the host's observation text: sections at the margin, a block `Team <name>` with the units
that the team sees, and `Valid actions` with a line a team. A line that is none of these is passed over, so
that sections may be added to the text without this module knowing.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

_NUMBER = r"(\d+(?:\.\d+)?)"
_SIGNED = r"(-?\d+(?:\.\d+)?)"
_SECTION = re.compile(r"\n(?=\S)")
_TEAM = re.compile(r"Team (\S+)")
_UNITS = re.compile(r"^    (Your|Allied|Enemy) units:\n((?:        .*\n?)*)", re.MULTILINE)
_UNIT = re.compile(
    rf"^        \w+ \| tag (0x[0-9a-f]+) \| screen \[{_SIGNED}, {_SIGNED}\][^|\n]*"
    rf"(?:\| distance {_NUMBER} )?\| health {_NUMBER}/[\d.]+(?: \| shield {_NUMBER})?",
    re.MULTILINE | re.ASCII,
)
_SCREEN = re.compile(rf"    Screen on the map: x {_SIGNED} to {_SIGNED}, y {_SIGNED} to {_SIGNED}", re.ASCII)
_VALID = re.compile(r"^    Team (\S+): (.*)", re.MULTILINE)
_ACTION = re.compile(r"<(\w+)\(([a-z, ]*)\)>")
_MAX_ACTIONS = re.compile(r"At most (\d{1,4}) actions? per team")
_WRITE_TO = re.compile(r"^    You can write to:\n((?:        .*\n?)*)", re.MULTILINE)
_NAME = re.compile(r"^        ([\w.-]+):", re.MULTILINE)


class Unit(NamedTuple):
    """A unit on a team's screen; `distance` is the host's, from the middle of the team, infinite if not given."""

    tag: str
    x: float
    y: float
    hit_points: float
    distance: float


class Action(NamedTuple):
    """A valid action and the kinds of its arguments."""

    name: str
    args: tuple[str, ...]


@dataclass(slots=True)
class Team:
    """A team, as its block and its line of valid actions tell."""

    name: str
    own: list[Unit] = field(default_factory=list)
    allies: list[Unit] = field(default_factory=list)
    enemies: list[Unit] = field(default_factory=list)
    actions: list[Action] = field(default_factory=list)
    bounds: tuple[float, float, float, float] = (0.0, 24.0, 0.0, 24.0)
    """Part of the screen that lies on the map: x from, to, y from, to."""


@dataclass(slots=True)
class Situation:
    """All that was understood of an observation."""

    teams: dict[str, Team] = field(default_factory=dict)
    max_actions: int = 1
    correspondents: list[str] = field(default_factory=list)


def read(text: str) -> Situation:
    """Reads an observation; an unknown text gives an empty situation."""
    situation = Situation()
    for section in _SECTION.split(text):
        title, _, body = section.partition("\n")
        if found := _TEAM.fullmatch(title):
            _read_team(_team(situation, found[1]), body)
        elif title == "Valid actions":
            _read_valid_actions(situation, body)
        elif title == "Communication" and (found := _WRITE_TO.search(body)):
            situation.correspondents = _NAME.findall(found[1])
        elif title == "Answer" and (found := _MAX_ACTIONS.search(body)):
            situation.max_actions = int(found[1])
    return situation


def _team(situation: Situation, name: str) -> Team:
    return situation.teams.setdefault(name, Team(name))


def _read_team(team: Team, body: str) -> None:
    groups = {"Your": team.own, "Allied": team.allies, "Enemy": team.enemies}
    for whose, lines in _UNITS.findall(body):
        groups[whose] += [
            Unit(tag, float(x), float(y), float(health) + float(shield or 0), float(distance or "inf"))
            for tag, x, y, distance, health, shield in _UNIT.findall(lines)
        ]
    if bounds := _SCREEN.search(body):
        x0, x1, y0, y1 = (float(number) for number in bounds.groups())
        team.bounds = (x0, x1, y0, y1)


def _read_valid_actions(situation: Situation, body: str) -> None:
    for team, listed in _VALID.findall(body):
        _team(situation, team).actions += [
            Action(name, tuple(args.split(", ")) if args else ()) for name, args in _ACTION.findall(listed)
        ]
