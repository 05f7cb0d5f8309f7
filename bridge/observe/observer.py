"""What each agent of a side sees, observation after observation: the outward half of a turn.

    observer.begin()                                     a new episode
    sight = observer.observe(snapshot, feedback)         sight.agents["Zealots"].text, .view

An observer remembers who has which unit, the sight before, which enemies were seen and which stages of the task were
reached, and nothing else; what it says is a function of the snapshots and feedbacks that it was given since `begin`.
No clock, no bus.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from bridge.observe import landmarks, side
from bridge.observe.chronicle import Chronicle
from bridge.observe.scene import Scene
from bridge.observe.sight import AgentSight, Sight
from bridge.observe.stages import Stages
from bridge.observe.teams import Roster
from bridge.observe.text import Feedback, Page, render, sections_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from bridge.frames import Camera, MapFrame
    from bridge.observe.image.album import Album
    from bridge.observe.text.page import Part, Section
    from bridge.state import Snapshot
    from bridge.task import AgentConfig, TaskConfig
    from protocol.messages import Landmark, TeamView, View


class Observer:
    """The eyes of one side."""

    def __init__(self, task: TaskConfig, roster: Callable[[Sequence[AgentConfig]], Roster] = Roster) -> None:
        """Takes a task, and whoever says which unit answers to which of its agents.

        Raises:
            ConfigError: an agent's configuration names a section that does not exist.
        """
        self._task = task
        self._new_roster = roster
        self._sections = {agent.name: sections_of(agent) for agent in task.agents}
        self._parts = {name: _parts(sections) for name, sections in self._sections.items()}
        self.begin()

    def begin(self) -> None:
        """Forgets the episode before."""
        self._episode = _Episode(self._new_roster(self._task.agents))

    def observe(self, snapshot: Snapshot, feedback: Mapping[str, Feedback] | None = None) -> Sight:
        """What every agent sees now, with what it is told of its last reply.

        Args:
            snapshot: what the game says.
            feedback: by agent; agents that are not in it are told nothing.
        """
        for _ in self.each(snapshot, feedback):
            pass
        return self.sight

    def each(self, snapshot: Snapshot, feedback: Mapping[str, Feedback] | None = None) -> Iterator[AgentSight]:
        """The same, agent by agent in the order of the task: the first can be asked while others are still looked for.

        The whole is in `sight` when the last agent has been taken.
        """
        episode, told = self._episode, feedback or {}
        episode.roster.update(snapshot.own, snapshot.player)
        scene = Scene(snapshot, self._task.frames, episode.scene)
        episode.chronicle.note(scene.bodies, snapshot.upgrades, snapshot.dead)
        album = self._album(snapshot, scene.world)
        agents: dict[str, AgentSight] = {}
        conditions: dict[str, str] = {}
        for config in self._task.agents:
            seen = self._agent(scene, config)
            page = Page(seen, self._task, told.get(config.name, Feedback()), conditions)
            text = render(page, self._sections[config.name], config.text_tokens)
            agents[config.name] = replace(seen, text=text, pictures=album.pictures(seen) if album else ())
            yield agents[config.name]
        episode.scene, episode.sight = scene, Sight(snapshot, scene.world, agents)

    @property
    def sight(self) -> Sight:
        """What was seen last."""
        assert self._episode.sight is not None, "nothing has been observed in this episode"
        return self._episode.sight

    def _album(self, snapshot: Snapshot, world: MapFrame) -> Album | None:
        """Who draws pictures; None if no agent is shown any, so that OpenCV is loaded only for those who are."""
        if not any(agent.images for agent in self._task.agents):
            return None
        from bridge.observe.image.album import Album  # noqa: PLC0415  # see above

        return Album(snapshot, world)

    def _agent(self, scene: Scene, agent: AgentConfig) -> AgentSight:
        episode, parts = self._episode, self._parts[agent.name]
        before = episode.sight.agents.get(agent.name) if episode.sight else None
        earlier = {team.view.name: team for team in before.teams} if before else {}
        builds = "resources" in parts and agent.kind == "builder"
        teams = []
        for team in episode.roster.teams(agent.name):
            seen = scene.team(agent, team, earlier.get(team.name), resources=builds)
            task = episode.stages.task(team, seen.view.minimap, scene.view.time_s)
            teams.append(replace(seen, view=seen.view.but(task=task)) if task else seen)
        view = self._view(scene, agent, [team.view for team in teams], teams[0].camera if teams else None)
        return AgentSight(agent, view, tuple(teams), episode.roster.idle_teams(agent.name))

    def _view(self, scene: Scene, agent: AgentConfig, teams: Sequence[TeamView], camera: Camera | None) -> View:
        """The view of an agent: that of all, its teams, and the parts that its page shows."""
        parts, chronicle = self._parts[agent.name], self._episode.chronicle
        view = scene.view.but(teams=tuple(teams))
        more: dict[str, object] = {}
        if "counts" in parts:
            more["counts"] = side.counts(scene, chronicle)
        if "events" in parts:
            more["events"] = chronicle.events
        if "alerts" in parts:
            more["alerts"], more["warnings"] = side.alerts(scene), side.warnings(scene)
        if "others" in parts:
            more["others"] = side.others(scene, self._episode.roster, self._task, agent.name)
        if "power" in parts:
            more["warp_gates"] = side.warp_gates(scene)
        if marks := tuple(_landmarks(scene, parts, camera)):
            more["landmarks"] = marks
        return view.but(**more) if more else view


@dataclass(slots=True)
class _Episode:
    """What is remembered during one episode."""

    roster: Roster
    chronicle: Chronicle = field(default_factory=Chronicle)
    stages: Stages = field(default_factory=Stages)
    scene: Scene | None = None
    sight: Sight | None = None


def _parts(sections: Sequence[Section]) -> frozenset[Part]:
    return frozenset(part for section in sections for part in section.parts)


def _landmarks(scene: Scene, parts: frozenset[Part], camera: Camera | None) -> Iterator[Landmark]:
    if "structures" in parts:
        yield from landmarks.structures(scene)
    if "power" in parts:
        yield from landmarks.power_fields(scene, camera)
    if "places" in parts:
        yield from landmarks.free_places(scene, camera)
