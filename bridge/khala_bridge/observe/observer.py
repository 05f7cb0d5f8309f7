"""What each agent of a side sees, observation after observation: the outward half of a turn.

    observer.begin()                                     a new episode
    seen = observer.observe(snapshot, feedback)          seen.agents["Zealots"].text, .view

An observer remembers who has which unit, its last observation, which enemies were seen and which stages of the task
were reached, and nothing else; what it says is a function of the snapshots and feedbacks that it was given since
`begin`. No clock, no bus.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from khala_bridge.observe import landmarks, side
from khala_bridge.observe.chronicle import Chronicle
from khala_bridge.observe.observation import AgentObservation, SideObservation
from khala_bridge.observe.scene import Scene
from khala_bridge.observe.stages import Stages
from khala_bridge.observe.text import Feedback, Page, render, sections_of
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
        """Take a task, and what says which unit answers to which of its agents.

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
        """Return what the side sees now, with what each agent hears about its last reply.

        What an agent sees is made when `agents` is first asked for it, so that one agent can think while the host
        still looks for the others. What nobody asked for is made when the next observation begins.

        Args:
            snapshot: what the game says.
            feedback: by agent; an agent that is not in it hears nothing.
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
        """Who draws pictures; None if no agent is shown any, so that OpenCV is loaded only for those who are."""
        if not any(agent.images for agent in self._task.agents):
            return None
        from khala_bridge.observe.image.album import Album  # noqa: PLC0415  # see above

        return Album(snapshot, world)

    def _agent(self, moment: _Moment, agent: AgentConfig) -> AgentObservation:
        """What one agent sees, in words and pictures."""
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
        """The view of an agent: that of all, its teams, and the parts that its page shows."""
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
    """What is remembered during one episode."""

    roster: TeamRoster
    chronicle: Chronicle = field(default_factory=Chronicle)
    stages: Stages = field(default_factory=Stages)
    scene: Scene | None = None
    last: SideObservation | None = None

    def complete(self) -> SideObservation | None:
        """Return the last observation, with everything made that it could still be asked for."""
        if self.last is not None:
            tuple(self.last.agents.values())
        return self.last


@dataclass(frozen=True, slots=True)
class _Moment:
    """What the agents' parts of one observation are made of."""

    episode: _Episode
    scene: Scene
    earlier: SideObservation | None
    feedback: Mapping[str, Feedback]
    album: Album | None
    conditions: dict[str, str] = field(default_factory=dict)
    """By tag, what was written of a unit's condition."""


class _WhenAsked(Mapping[str, AgentObservation]):
    """What each agent sees, in the order of the task; made when it is first asked for."""

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
                self._make = None  # it holds the observation before, and that one the one before it
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
