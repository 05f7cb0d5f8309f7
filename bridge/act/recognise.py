"""Calls as written → actions of the catalogue, or rejections that say what would be right.

Only words are judged here: is there such an action, has it these arguments, is there such a team. What is
possible in the game now is judged in `bridge.act.translate`. Tolerated, because only one thing can be meant: names in
another case, a missing team heading when there is one team, a heading for all teams at once, a tag written as a
decimal number.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from protocol.messages import Rejection
from protocol.speech import render

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bridge.action import Action, ArgKind
    from bridge.observe.sight import AgentSight, TeamSight
    from protocol.messages import Call, Point, RejectionReason

EXAMPLES: dict[ArgKind, str] = {"tag": "0x100140001", "screen": "[12, 9.5]", "minimap": "[30, 41]"}
ALL_TEAMS = frozenset({"all", "all teams", "both", "both teams", "every team", "each team"})
_SMALLEST_TAG = 2**16  # smaller numbers are coordinates or counts, no tags


@dataclass(frozen=True, slots=True)
class Recognised:
    """A call that is an action of the catalogue, for one team."""

    call: Call
    action: Action
    team: TeamSight
    tags: tuple[int, ...]
    """Tags among its arguments, in their order."""
    point: Point | None
    """The point among its arguments, in the frame that the action says."""

    @property
    def text(self) -> str:
        """The call as agents and reports read it: `Stalker-1 <Attack_Unit(0x1)>`."""
        return f"{self.team.view.name} {self.written}"

    @property
    def written(self) -> str:
        """The call alone, with the name as in the catalogue: `<Attack_Unit(0x1)>`."""
        return render(self.call.model_copy(update={"name": self.action.name}))


class Refused(Exception):
    """Leaves the checks of a call with the reason of its rejection."""

    def __init__(self, reason: RejectionReason, message: str) -> None:
        self.reason, self.message = reason, message


def recognise(call: Call, agent: AgentSight) -> list[Recognised] | Rejection:
    """What a call means: one action, or one for each team if it stands under a heading for all."""
    try:
        action = _action(call, agent)
        teams = _teams(call, agent)
        tags, point = _arguments(call, action)
    except Refused as refused:
        return reject(call, refused)
    return [Recognised(call, action, team, tags, point) for team in teams]


def reject(call: Call, refused: Refused, team: str | None = None) -> Rejection:
    """A rejection of a call, with its place in the reply."""
    return Rejection(
        reason=refused.reason, message=refused.message, text=render(call), start=call.start, team=team or call.team
    )


def _action(call: Call, agent: AgentSight) -> Action:
    known = {action.name.casefold(): action for action in agent.agent.catalogue()}
    if action := known.get(call.name.casefold()):
        return action
    close = difflib.get_close_matches(call.name.casefold(), list(known), n=1)
    if close:
        hint = f"did you mean {known[close[0]].form}?"
    else:
        hint = "your actions are " + ", ".join(action.form for action in known.values()) + "."
    raise Refused("unknown_action", f"There is no action {call.name}; {hint}")


def _teams(call: Call, agent: AgentSight) -> Sequence[TeamSight]:
    by_name = {team.view.name.casefold(): team for team in agent.teams}
    names = ", ".join(team.view.name for team in agent.teams)
    if not agent.teams:
        raise Refused("unknown_team", "You have no units left, so no team can act.")
    if call.team is None and len(agent.teams) > 1:
        ask = 'write "Team <name>:" above the action'
        raise Refused("unknown_team", f"No team is named: {ask}; your teams are {names}.")
    wanted = " ".join((call.team or agent.teams[0].view.name).casefold().split())
    if team := by_name.get(wanted) or by_name.get(wanted.replace(" ", "-")):
        return [team]
    if wanted in ALL_TEAMS:
        return agent.teams
    if wanted in (name.casefold() for name in agent.idle_teams):
        raise Refused("unknown_team", f"Team {call.team} has no units left; your teams are {names}.")
    raise Refused("unknown_team", f"You have no team {call.team}; your teams are {names}.")


def _arguments(call: Call, action: Action) -> tuple[tuple[int, ...], Point | None]:
    given = [_typed(argument) for argument in call.args]
    fits = len(given) == len(action.args) and all(
        isinstance(value, int if kind == "tag" else tuple) for kind, value in zip(action.args, given, strict=True)
    )
    if not fits:
        raise Refused("wrong_arguments", _right_form(action))
    tags = tuple(value for value in given if isinstance(value, int))
    return tags, next((value for value in given if isinstance(value, tuple)), None)


def _typed(argument: str | Point) -> int | Point | str:
    """A tag as a number, a point as it is, anything else as text."""
    if not isinstance(argument, str):
        return argument
    if argument.startswith("0x"):
        return int(argument, 16)
    if argument.isascii() and argument.isdigit() and int(argument) >= _SMALLEST_TAG:
        return int(argument)
    return argument


def _right_form(action: Action) -> str:
    if not action.args:
        return f"{action.name} takes no arguments: write <{action.name}()>."
    example = ", ".join(EXAMPLES[kind] for kind in action.args)
    return f"{action.name} takes ({', '.join(action.args)}): write it like <{action.name}({example})>."
