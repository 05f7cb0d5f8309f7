"""The addressee of a call: the heading above it, or no heading → teams of the agent.

| heading | means |
|---|---|
| the name of a team, however written: `stalker 1`, `Stalker_1` | that team |
| a kind of units, if one team is called so: `Stalkers` for Stalker-1 | that team |
| the name of the agent itself, if it has one team | that team |
| several teams with commas or "and" between | each of them |
| "all teams" in some language, "both teams" if there are two | each that has such an action |
| none | the only team; or the one whose unit is named first; or the only one that has such an action |
| any, with an action for units of the whole side | the team of the side that has it |

Words only, as in `khala_bridge.act.recognise` above it; whether the team can do it now is checked later.
"""

from __future__ import annotations

import difflib
import re
from typing import TYPE_CHECKING

from khala_bridge.act.rejected import CallRejected
from khala_bridge.act.vocabulary import squash
from khala_bridge.observe.mark_digits import mark_digits

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_bridge.act.vocabulary import Vocabulary
    from khala_bridge.catalogue.action import Action
    from khala_bridge.observe.observation import AgentObservation, TeamObservation

_EVERY_TEAM = (
    "all, all teams, all units, all my teams, every, every team, each, each team, everyone, alle, alle Teams, todos, "
    "todos los equipos, todas as equipes, toutes les équipes, все команды, 所有队伍, 所有小队, 全部队伍, 所有隊伍, "
    "全チーム, 모든 팀"
)
ALL = frozenset(squash(words) for words in _EVERY_TEAM.split(", "))
BOTH = frozenset({"both", "bothteams", "beide", "beideteams"})
_BETWEEN = re.compile(r"\s*[,;&/+、]\s*(?:and\b)?\s*|\s+(?:and|und|et|y|e|и)\s+|和|与")
_TEAM_WORD = re.compile(r"(?:the\s+)?teams?\s+", re.IGNORECASE)


class Addressees:
    """The teams of one agent, as its calls may address them."""

    def __init__(self, agent: AgentObservation, words: Vocabulary) -> None:
        """Take the observation on which the agent decided, which names its teams, and the names that it may use."""
        self._agent = agent
        self._words = words
        self._by_name = {squash(team.name): team for team in agent.teams}

    def meant(self, heading: str | None, action: Action, tags: Sequence[int]) -> Sequence[TeamObservation]:
        """Return the teams that a call addresses, at least one.

        Args:
            heading: the team as written above the call; None without a heading.
            action: the action of the call.
            tags: the tags among its arguments.

        Raises:
            CallRejected: the call fits no team, names a missing one, or fits more than one.
        """
        if not self._agent.teams:
            raise CallRejected("unknown_team", "You have no units left, so no team can act.")
        if heading is None:
            return [self._without_heading(action, tags)]
        named = self._under_heading(heading, action)
        if action.subject == "side" and not any(self._words.has(team, action) for team in named):
            of_side = [team for team in self._able(action) if not team.tags]
            return of_side if len(of_side) == 1 else named
        return named

    def listening(self, heading: str | None) -> Sequence[TeamObservation]:
        """Return the team of a heading, or all of them."""
        team = None if heading is None else self._team_called(heading)
        return self._agent.teams if team is None else [team]

    def tag_called(self, digits: str) -> int | None:
        """Return the tag of the only unit in sight that these digits stand for: its tag without 0x, or its mark."""
        tags = {int(tag, 16) for tag in self._tags()}
        meant = [tag for tag in tags if digits == f"{tag:x}" or digits in mark_digits(tag)]
        return meant[0] if len(meant) == 1 else None

    def sample_tags(self, action: Action) -> Sequence[str]:
        """Return tags in sight for an example of an action, the actors first; nothing if there are not enough."""
        views = [team.view for team in self._agent.teams]
        actors = [unit.tag for view in views for unit in view.units][: action.actor_count]
        enemies = [unit.tag for view in views for unit in view.enemies]
        own = [unit.tag for view in views for unit in (*view.allies, *view.units)]
        aims = {"enemy": enemies, "own": own}.get(action.target or "", [*enemies, *own])
        targets = [tag for tag in aims if tag not in actors]
        wanted = action.args.count("tag")
        found = (*actors, *targets[: wanted - action.actor_count])
        return found if len(found) == wanted else ()

    def _tags(self) -> Iterator[str]:
        """Return the tags of all units that the agent sees."""
        return (unit.tag for team in self._agent.teams for unit in team.units_in_view())

    def _able(self, action: Action) -> list[TeamObservation]:
        """Return the teams that have the action."""
        return [team for team in self._agent.teams if self._words.has(team, action)]

    def _without_heading(self, action: Action, tags: Sequence[int]) -> TeamObservation:
        """Return the team that a call without a heading means."""
        teams = self._agent.teams
        if len(teams) == 1:
            return teams[0]
        owners = [team for team in teams if tags[0] in team.tags] if action.actor_count else []
        for candidates in (owners, self._able(action)):
            if len(candidates) == 1:
                return candidates[0]
        ask = 'write "Team <name>:" above the action'
        raise CallRejected("unknown_team", f"No team is named: {ask}; {self._your_teams()}")

    def _under_heading(self, heading: str, action: Action) -> Sequence[TeamObservation]:
        """Return the teams that a heading names."""
        plain = squash(heading)
        if team := self._team_called(heading):
            return [team]
        if plain in ALL or (plain in BOTH and len(self._agent.teams) == len("AB")):
            return self._able(action) or self._agent.teams
        several = [self._team_called(_TEAM_WORD.sub("", part)) for part in _BETWEEN.split(heading) if part.strip()]
        if len(several) > 1 and None not in several:
            return list({team.name: team for team in several if team is not None}.values())
        if plain in map(squash, self._agent.idle_teams):
            raise CallRejected("unknown_team", f"Team {heading} has no units left; {self._your_teams()}")
        close = difflib.get_close_matches(plain, self._by_name, n=1, cutoff=0.75)
        meant = f"did you mean {self._by_name[close[0]].view.name}? Your" if close else "your"
        raise CallRejected("unknown_team", f"You have no team {heading}; {self._your_teams(meant)}")

    def _team_called(self, name: str) -> TeamObservation | None:
        """Return the one team that a name can mean."""
        plain = squash(name)
        if found := self._by_name.get(plain):
            return found
        if plain == squash(self._agent.agent.name) and len(self._agent.teams) == 1:
            return self._agent.teams[0]
        forms = (plain, plain.rstrip("s"))
        kinds = [team for written, team in self._by_name.items() if written.rstrip("0123456789") in forms]
        return kinds[0] if len(kinds) == 1 else None

    def _your_teams(self, your: str = "your") -> str:
        return f"{your} teams are {', '.join(team.name for team in self._agent.teams)}."
