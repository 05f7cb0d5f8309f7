"""What a side sees at one moment: the views of its agents, and what the host needs to carry out their answers.

Cameras, tags and the snapshot stay on the host; no world coordinate is in a view. `khala_bridge.observe.observer` makes
observations; they are values.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_bridge.observe.events import Witnessed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_bridge.frames import Camera, MapFrame
    from khala_bridge.observe.picture import Picture
    from khala_bridge.state import Snapshot
    from khala_bridge.state.teams import Team
    from khala_bridge.task.config import AgentConfig
    from khala_protocol.messages import TeamView, View

__all__ = ["AgentObservation", "SideObservation", "TeamObservation"]


@dataclass(frozen=True, slots=True)
class TeamObservation:
    """A team, its camera and its view."""

    team: Team
    camera: Camera | None
    """None for a team without units, which orders those of the whole side."""
    view: TeamView
    tags: Witnessed = field(default_factory=Witnessed)
    """Tags of the units in the view."""


@dataclass(frozen=True, slots=True)
class AgentObservation:
    """What one agent sees; `text` is empty until it is written."""

    agent: AgentConfig
    view: View
    teams: tuple[TeamObservation, ...]
    idle_teams: tuple[str, ...]
    """Teams that have no unit now."""
    text: str = ""
    pictures: tuple[Picture, ...] = ()
    """What it is shown besides the words."""


@dataclass(frozen=True, slots=True)
class SideObservation:
    """What a side sees at one moment: the snapshot and what its agents make of it."""

    snapshot: Snapshot
    map: MapFrame
    agents: Mapping[str, AgentObservation]
    """By name, in the order of the task."""
