"""Whom a call speaks to: the words of a heading, or their absence → teams of the agent.

| heading | means |
|---|---|
| the name of a team, however written: `stalker 1`, `Stalker_1` | that team |
| a kind of units, if one team is called so: `Stalkers` for Stalker-1 | that team |
| the name of the agent itself, if it has one team | that team |
| several teams with commas or "and" between | each of them |
| "all teams" in some language, "both teams" if there are two | each that may ever be told such an action |
| none | the only team; or the one whose unit is named first; or the only one that may ever be told such an action |
| any, with an action for units of the whole side | the team of the side that has it |

Words only, as in `bridge.act.recognise` above it: whether the team can do it now is not asked.
"""

from __future__ import annotations

import difflib
import re
from typing import TYPE_CHECKING

from bridge.act.refused import Refused
from bridge.act.vocabulary import squashed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bridge.act.vocabulary import Vocabulary
    from bridge.action import Action
    from bridge.observe.sight import AgentSight, TeamSight

_EVERY_TEAM = (
    "all, all teams, all units, all my teams, every, every team, each, each team, everyone, alle, alle Teams, todos, "
    "todos los equipos, todas as equipes, toutes les équipes, все команды, 所有队伍, 所有小队, 全部队伍, 所有隊伍, "
    "全チーム, 모든 팀"
)
ALL = frozenset(squashed(words) for words in _EVERY_TEAM.split(", "))
BOTH = frozenset({"both", "bothteams", "beide", "beideteams"})
_BETWEEN = re.compile(r"\s*[,;&/+、]\s*(?:and\b)?\s*|\s+(?:and|und|et|y|e|и)\s+|和|与")
_TEAM_WORD = re.compile(r"(?:the\s+)?teams?\s+", re.IGNORECASE)


def addressed(
    heading: str | None, action: Action, tags: Sequence[int], agent: AgentSight, words: Vocabulary
) -> Sequence[TeamSight]:
    """The teams that a call speaks to, at least one.

    Args:
        heading: the team as written above the call; None if there was none.
        action: what they are to do.
        tags: the tags among its arguments.
        agent: whose teams they are.
        words: the names that the agent may say.

    Raises:
        Refused: no team is meant, or one that is not there, or more than one may be.
    """
    if not agent.teams:
        raise Refused("unknown_team", "You have no units left, so no team can act.")
    able = [team for team in agent.teams if words.has(team, action)]
    if heading is None:
        return [_unnamed(action, tags, agent, able)]
    named = _named(heading, agent, able)
    of_side = [team for team in able if not team.team.tags]
    if action.subject == "side" and len(of_side) == 1 and not any(team in able for team in named):
        return of_side
    return named


def _unnamed(action: Action, tags: Sequence[int], agent: AgentSight, able: Sequence[TeamSight]) -> TeamSight:
    """The team that is meant where none is named."""
    if len(agent.teams) == 1:
        return agent.teams[0]
    if action.named:
        owners = [team for team in agent.teams if tags[0] in team.team.tags]
        if len(owners) == 1:
            return owners[0]
    if len(able) == 1:
        return able[0]
    ask = 'write "Team <name>:" above the action'
    raise Refused("unknown_team", f"No team is named: {ask}; {_your_teams(agent)}")


def _named(heading: str, agent: AgentSight, able: Sequence[TeamSight]) -> Sequence[TeamSight]:
    """The teams that a heading names."""
    plain = squashed(heading)
    if team := _one(heading, agent):
        return [team]
    if plain in ALL or (plain in BOTH and len(agent.teams) == len("AB")):
        return able or agent.teams
    several = [_one(_TEAM_WORD.sub("", part), agent) for part in _BETWEEN.split(heading) if part.strip()]
    if len(several) > 1 and None not in several:
        return list({team.view.name: team for team in several if team is not None}.values())
    if plain in map(squashed, agent.idle_teams):
        raise Refused("unknown_team", f"Team {heading} has no units left; {_your_teams(agent)}")
    by_name = {squashed(team.view.name): team.view.name for team in agent.teams}
    close = difflib.get_close_matches(plain, by_name, n=1, cutoff=0.75)
    meant = f"did you mean {by_name[close[0]]}? Your" if close else "your"
    raise Refused("unknown_team", f"You have no team {heading}; {_your_teams(agent, meant)}")


def _one(name: str, agent: AgentSight) -> TeamSight | None:
    """The one team that a name can mean."""
    plain = squashed(name)
    by_name = {squashed(team.view.name): team for team in agent.teams}
    if found := by_name.get(plain):
        return found
    if plain == squashed(agent.agent.name) and len(agent.teams) == 1:
        return agent.teams[0]
    kinds = [team for written, team in by_name.items() if written.rstrip("0123456789") in (plain, plain.rstrip("s"))]
    return kinds[0] if len(kinds) == 1 else None


def _your_teams(agent: AgentSight, your: str = "your") -> str:
    return f"{your} teams are {', '.join(team.view.name for team in agent.teams)}."
