"""The observations of each agent of a side, one after the other: the first half of a turn.

    observer.begin()                                     a new episode
    seen = observer.observe(snapshot, feedback)          seen.agents["Zealots"].text, .view

An observer remembers the units of each team, its last observation, the enemies that were seen and the stages of the
task that were reached, and nothing else: its result is a function of the snapshots and feedbacks since `begin`. No
clock, no bus.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from khala_bridge.observe import landmarks, side
from khala_bridge.observe.chronicle import Chronicle
from khala_bridge.observe.feedback import Feedback
from khala_bridge.observe.observation import AgentObservation, SideObservation
from khala_bridge.observe.scene import Scene
from khala_bridge.observe.stages import Stages
from khala_bridge.observe.text import Page, render, sections_of
from khala_bridge.state.teams import TeamRoster

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from khala_bridge.frames import Camera, MapFrame
    from khala_bridge.observe.image.album import Album
    from khala_bridge.observe.text.page import Part, Section
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import AgentConfig, TaskConfig
    from khala_protocol.messages import Landmark, TeamView, View


class Observer:
    """The eyes of one side."""

    def __init__(self, task: TaskConfig, roster: Callable[[Sequence[AgentConfig]], TeamRoster] = TeamRoster) -> None:
        """Take a task, and the grouping of units into the teams of its agents.

        Raises:
            ConfigError: an agent's configuration names a section that does not exist.
        """
        self._task = task
        self._new_roster = roster
        self._sections = {agent.name: sections_of(agent) for agent in task.agents}
        self._parts = {name: _parts(sections) for name, sections in self._sections.items()}
        self.begin()

    def begin(self) -> None:
        """Forget the episode before."""
        self._episode = _Episode(self._new_roster(self._task.agents))

    def observe(self, snapshot: Snapshot, feedback: Mapping[str, Feedback] | None = None) -> SideObservation:
        """Return what the side sees now, with the feedback on each agent's last reply.

        An agent's observation is made on the first access through `agents`, so that one agent can think while the
        host still observes for the others. Unused ones are made when the next observation begins.

        Args:
            snapshot: the state of the game.
            feedback: by agent; an agent that is not in it gets none.
        """
        episode = self._episode
        earlier = episode.complete()
        episode.roster.update(snapshot.own, snapshot.player)
        scene = Scene(snapshot, self._task.frames, episode.scene)
        episode.chronicle.note(scene.bodies, snapshot.upgrades, snapshot.dead)
        moment = _Moment(episode, scene, earlier, feedback or {}, self._album(snapshot, scene.world))
        agents = _WhenAsked(self._task.agents, partial(self._agent, moment))
        episode.scene, episode.last = scene, SideObservation(snapshot, scene.world, agents)
        return episode.last

    def _album(self, snapshot: Snapshot, world: MapFrame) -> Album | None:
        """Return the album of the moment; None if no agent has pictures, so that OpenCV is loaded only when needed."""
        if not any(agent.images for agent in self._task.agents):
            return None
        from khala_bridge.observe.image.album import Album  # noqa: PLC0415  # see above

        return Album(snapshot, world)

    def _agent(self, moment: _Moment, agent: AgentConfig) -> AgentObservation:
        """Return the observation of one agent, in words and pictures."""
        seen = self._seen(moment, agent)
        page = Page(seen, self._task, moment.feedback.get(agent.name, Feedback()), moment.conditions)
        text = render(page, self._sections[agent.name], agent.text_tokens)
        return replace(seen, text=text, pictures=moment.album.pictures(seen) if moment.album else ())

    def _seen(self, moment: _Moment, agent: AgentConfig) -> AgentObservation:
        episode, scene = moment.episode, moment.scene
        before = moment.earlier.agents.get(agent.name) if moment.earlier else None
        earlier = {team.view.name: team for team in before.teams} if before else {}
        builds = "resources" in self._parts[agent.name] and agent.kind == "builder"
        teams = []
        for team in episode.roster.teams(agent.name):
            seen = scene.team(agent, team, earlier.get(team.name), resources=builds)
            task = episode.stages.task(team, seen.view.minimap, scene.view.time_s)
            teams.append(replace(seen, view=seen.view.but(task=task)) if task else seen)
        view = self._view(moment, agent, [team.view for team in teams], teams[0].camera if teams else None)
        return AgentObservation(agent, view, tuple(teams), episode.roster.idle_teams(agent.name))

    def _view(self, moment: _Moment, agent: AgentConfig, teams: Sequence[TeamView], camera: Camera | None) -> View:
        """Return the view of an agent: the common part, its teams, and the parts that its page shows."""
        scene, parts, chronicle = moment.scene, self._parts[agent.name], moment.episode.chronicle
        view = scene.view.but(teams=tuple(teams))
        more: dict[str, object] = {}
        if "counts" in parts:
            more["counts"] = side.counts(scene, chronicle)
        if "events" in parts:
            more["events"] = chronicle.events
        if "alerts" in parts:
            more["alerts"], more["warnings"] = side.alerts(scene), side.warnings(scene)
        if "others" in parts:
            more["others"] = side.others(scene, moment.episode.roster, self._task, agent.name)
        if "power" in parts:
            more["warp_gates"] = side.warp_gates(scene)
        if marks := tuple(_landmarks(scene, parts, camera)):
            more["landmarks"] = marks
        return view.but(**more) if more else view


@dataclass(slots=True)
class _Episode:
    """The memory of one episode."""

    roster: TeamRoster
    chronicle: Chronicle = field(default_factory=Chronicle)
    stages: Stages = field(default_factory=Stages)
    scene: Scene | None = None
    last: SideObservation | None = None

    def complete(self) -> SideObservation | None:
        """Return the last observation, with all its lazy parts made."""
        if self.last is not None:
            tuple(self.last.agents.values())
        return self.last


@dataclass(frozen=True, slots=True)
class _Moment:
    """The common input of all agents' observations at one moment."""

    episode: _Episode
    scene: Scene
    earlier: SideObservation | None
    feedback: Mapping[str, Feedback]
    album: Album | None
    conditions: dict[str, str] = field(default_factory=dict)
    """By tag, the written condition of a unit."""


class _WhenAsked(Mapping[str, AgentObservation]):
    """The observation of each agent, in the order of the task; made on first access."""

    def __init__(self, agents: Sequence[AgentConfig], make: Callable[[AgentConfig], AgentObservation]) -> None:
        self._agents = {agent.name: agent for agent in agents}
        self._made: dict[str, AgentObservation] = {}
        self._make: Callable[[AgentConfig], AgentObservation] | None = make

    def __getitem__(self, name: str) -> AgentObservation:
        agent = self._agents[name]
        if name not in self._made:
            assert self._make is not None
            self._made[name] = self._make(agent)
            if len(self._made) == len(self._agents):
                self._make = None  # it holds the observation before, which holds the one before that
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._agents)

    def __len__(self) -> int:
        return len(self._agents)


def _parts(sections: Sequence[Section]) -> frozenset[Part]:
    return frozenset(part for section in sections for part in section.parts)


def _landmarks(scene: Scene, parts: frozenset[Part], camera: Camera | None) -> Iterator[Landmark]:
    if "structures" in parts:
        yield from landmarks.structures(scene)
    if "power" in parts:
        yield from landmarks.power_fields(scene, camera)
    if "places" in parts:
        yield from landmarks.free_places(scene, camera)
