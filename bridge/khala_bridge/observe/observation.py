"""The observation of a side at one moment: the views of its agents, and what the host needs to carry out replies.

Cameras, tags and the snapshot stay on the host; a view has no world coordinates. `khala_bridge.observe.observer` makes
observations; they are values. An agent may decide on its observation long after the side has moved on.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING

from khala_bridge.observe.events import Witnessed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from khala_bridge.frames import Camera, MapFrame
    from khala_bridge.observe.picture import Picture
    from khala_bridge.state import Snapshot
    from khala_bridge.state.teams import Team
    from khala_bridge.task.config import AgentConfig
    from khala_protocol.messages import TeamView, UnitView, View

__all__ = ["AgentObservation", "SideObservation", "TeamObservation"]


@dataclass(frozen=True, slots=True)
class TeamObservation:
    """A team, its camera and its view."""

    team: Team
    camera: Camera | None
    """None for a team without units, which orders units of the whole side."""
    view: TeamView
    tags: Witnessed = field(default_factory=Witnessed)
    """Tags of the units in the view."""

    def seen(self, tag: int) -> UnitView | None:
        """Return the view of a unit of the team or on its screen, except resources; None if it was not there."""
        wanted = hex(tag)
        units = chain(self.view.units, self.view.allies, self.view.enemies)
        return next((unit for unit in units if unit.tag == wanted), None)


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

    def team_of(self, tag: int) -> str | None:
        """Return the name of the team that has an own unit; None if no team has it."""
        teams = (team for its in self.teams.values() for team in its)
        return next((team.name for team in teams if tag in team.tags), None)
