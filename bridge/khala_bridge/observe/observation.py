"""The observation of a side at one moment: the views of its agents, and what the host needs to carry out replies.

Cameras, tags and the snapshot stay on the host; a view has no world coordinates. `khala_bridge.observe.observer` makes
observations; they are values. An agent may decide on its observation long after the side has moved on.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING

from khala_bridge.observe.events import Witnessed
from khala_bridge.observe.feedback import Feedback

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from khala_bridge.frames import Camera, MapFrame
    from khala_bridge.observe.picture import Picture
    from khala_bridge.state import Snapshot
    from khala_bridge.state.teams import Team
    from khala_bridge.task.config import AgentConfig, TeamConfig, TeamKind
    from khala_protocol.messages import TeamView, UnitView, View

__all__ = ["AgentObservation", "SideObservation", "TeamObservation"]


@dataclass(frozen=True, slots=True)
class TeamObservation:
    """A team, its camera and its view."""

    team: Team
    camera: Camera | None
    """None for a team without units, which orders units of the whole side."""
    view: TeamView
    witnessed: Witnessed = field(default_factory=Witnessed)
    """Tags of the units in the view."""

    @property
    def agent(self) -> str:
        """Name of the agent whose team it is."""
        return self.team.agent

    @property
    def name(self) -> str:
        """Its name, in the view as well."""
        return self.team.name

    @property
    def kind(self) -> TeamKind:
        """How it takes its units; a `side` team has none."""
        return self.team.kind

    @property
    def tags(self) -> tuple[int, ...]:
        """Its own units, the head first."""
        return self.team.tags

    @property
    def config(self) -> TeamConfig:
        """Its part of the task."""
        return self.team.config

    def seen(self, tag: int) -> UnitView | None:
        """Return the view of a unit of the team or on its screen, except resources; None if it was not there."""
        wanted = hex(tag)
        return next((unit for unit in self.units_in_view() if unit.tag == wanted), None)

    def units_in_view(self) -> Iterator[UnitView]:
        """Return the views of its units and of those on its screen, except resources."""
        return chain(self.view.units, self.view.allies, self.view.enemies)


@dataclass(frozen=True, slots=True)
class AgentObservation:
    """The observation of one agent; `text` is empty until it is written."""

    agent: AgentConfig
    game_loop: int
    """Of the snapshot that it shows."""
    view: View
    teams: tuple[TeamObservation, ...]
    idle_teams: tuple[str, ...]
    """Teams that have no unit now."""
    heard: Feedback = field(default_factory=Feedback)
    """The results of the agent's last reply, and the messages of others."""
    text: str = ""
    pictures: tuple[Picture, ...] = ()
    """Its pictures."""


@dataclass(frozen=True, slots=True)
class SideObservation:
    """The observation of a side: what is known without any agent's observation, and these observations."""

    snapshot: Snapshot
    map: MapFrame
    configs: Mapping[str, AgentConfig]
    """By name of an agent, in the order of the task."""
    teams: Mapping[str, Sequence[Team]]
    """By name of an agent, its teams that have units now and its `side` teams."""
    died: Mapping[int, int]
    """By tag of a unit that died in this episode, the game loop of the snapshot that reported its death."""
    agents: Mapping[str, AgentObservation]
    """By name, in the order of the task. Each is made on first access, while the moment is the present one; later there
    are only those that were made."""

    def team_now(self, seen: TeamObservation) -> Team | None:
        """Return the present team of an observation, which may be older; None if it has no unit any more."""
        return next((team for team in self.teams[seen.agent] if team.name == seen.name), None)

    def team_of(self, tag: int) -> str | None:
        """Return the name of the team that has an own unit; None if no team has it."""
        teams = (team for its in self.teams.values() for team in its)
        return next((team.name for team in teams if tag in team.tags), None)
