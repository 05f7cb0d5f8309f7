"""Calls as written → actions of the catalogue, or rejections that name the right form.

Only words are judged here: whether the action exists, takes these arguments, and whether the team exists.
`khala_bridge.act.translate` judges what is possible in the game now. A call that can mean only one thing is repaired:

| written | taken as |
|---|---|
| a name in another case, with blanks or hyphens, an alias | the action (`khala_bridge.act.vocabulary`) |
| `stalker 1`, no team, several, all teams | those that are meant (`khala_bridge.act.addressee`) |
| a tag as a decimal number, without 0x, or as its mark in a picture | the tag |
| a point before the tags | the tags, then the point |
| `None` for no argument | no argument |

Everything else is rejected, with the nearest valid names.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_bridge.act.rejected import CallRejected, reject
from khala_protocol.speech import written

if TYPE_CHECKING:
    from khala_bridge.act.addressee import Addressees
    from khala_bridge.act.vocabulary import Vocabulary
    from khala_bridge.catalogue.action import Action, ArgKind
    from khala_bridge.observe.observation import TeamObservation
    from khala_protocol.messages import Call, Point, Rejection

__all__ = ["CallRejected", "Recognised", "recognise", "reject"]

POINTS: dict[ArgKind, str] = {"screen": "[12, 9.5]", "minimap": "[30, 41]"}
_SMALLEST_TAG = 2**16  # smaller numbers are coordinates or counts, not tags
_USUAL_TAG = 2**32  # tags of a game are larger; in decimal they have ten digits, in hexadecimal nine
_HEX = re.compile(r"[0-9a-f]{3,16}", re.IGNORECASE)
_LONGEST_TAG = 20  # digits of 2^64
_NOTHING = frozenset({"none", "null", "nil", "n/a", "-"})


@dataclass(frozen=True, slots=True)
class Recognised:
    """A call that is an action of the catalogue, for one team."""

    call: Call
    action: Action
    team: TeamObservation
    tags: tuple[int, ...]
    """Tags among its arguments, in order."""
    point: Point | None
    """The point among its arguments, in the action's frame."""

    @property
    def text(self) -> str:
        """The call as agents and reports read it: `Stalker-1 <Attack_Unit(0x1)>`."""
        return f"{self.team.name} {self.written}"

    @property
    def written(self) -> str:
        """The call alone, in the catalogue's spelling: `<Attack_Unit(0x1)>`."""
        tags = tuple(map(hex, self.tags))
        return written(self.action.name, tags if self.point is None else (*tags, self.point))


def recognise(call: Call, words: Vocabulary, addressees: Addressees) -> list[Recognised] | Rejection:
    """Return what a call means: one action, or one for each team that it addresses.

    Args:
        call: as read in the reply.
        words: the names that the agent may use.
        addressees: the teams that it may address.
    """
    try:
        action = _action(call, words, addressees)
        tags, point = _arguments(call, action, addressees)
        teams = addressees.meant(call.team, action, tags)
    except CallRejected as refused:
        return reject(call, refused)
    return [Recognised(call, action, team, tags, point) for team in teams]


def _action(call: Call, words: Vocabulary, addressees: Addressees) -> Action:
    if action := words.find(call.name):
        return action
    hint = words.hint(call.name, addressees.listening(call.team))
    raise CallRejected("unknown_action", f"There is no action {call.name}; {hint}")


def _arguments(call: Call, action: Action, addressees: Addressees) -> tuple[tuple[int, ...], Point | None]:
    given = [_read_argument(argument, addressees) for argument in call.args]
    if not action.args and _is_nothing(given):
        given = []
    tags = tuple(value for value in given if isinstance(value, int))
    points = [value for value in given if isinstance(value, tuple)]
    wanted = action.args.count("tag")
    if len(given) != len(action.args) or len(tags) != wanted or len(points) != len(action.args) - wanted:
        raise CallRejected("wrong_arguments", _right_form(action, addressees))
    return tags, points[0] if points else None


def _read_argument(argument: str | Point, addressees: Addressees) -> int | Point | str:
    """Return a tag as a number, a point as it is, anything else as text.

    A tag may lack its 0x, and may be the mark that stands beside the unit in a picture.
    """
    if not isinstance(argument, str):
        return argument
    if argument.startswith("0x"):
        try:
            return int(argument, 16)
        except ValueError:
            return argument
    seen = addressees.tag_called(argument.casefold())
    return _bare_tag(argument) if seen is None else seen


def _bare_tag(digits: str) -> int | str:
    """Return the tag that these digits without 0x are, hexadecimal or decimal; the text if they are none."""
    number = int(digits) if digits.isascii() and digits.isdigit() and len(digits) <= _LONGEST_TAG else 0
    if number < _USUAL_TAG and _HEX.fullmatch(digits) and int(digits, 16) >= _USUAL_TAG:
        return int(digits, 16)
    return number if number >= _SMALLEST_TAG else digits


def _is_nothing(given: list[int | Point | str]) -> bool:
    return len(given) == 1 and isinstance(given[0], str) and given[0].casefold() in _NOTHING


def _right_form(action: Action, addressees: Addressees) -> str:
    if not action.args:
        return f"{action.name} takes no arguments: write <{action.name}()>."
    tags = addressees.sample_tags(action)
    if len(tags) < action.args.count("tag"):
        whose = {"enemy": "an enemy", "own": "a unit of yours"}.get(action.target or "", "a unit")
        return f"{action.name} takes ({', '.join(action.args)}), the tag of {whose} in sight; you see none now."
    left = iter(tags)
    example = ", ".join(POINTS.get(kind) or next(left) for kind in action.args)
    return f"{action.name} takes ({', '.join(action.args)}): write it like <{action.name}({example})>."
