"""The observations of each agent of a side, one after the other: the first half of a turn.

    observer.begin()                                     a new episode
    seen = observer.observe(snapshot, feedback)          seen.agents["Zealots"].text, .view

It takes in every snapshot, and makes the observations of those agents alone that are asked for: all of them at every
step, or each at its own pace. "Since the last observation" is since that of the same agent. An observer remembers the
units of each team, the last observation of each agent, what happened to the side and the stages of the task that were
reached, and nothing else: its result is a function of the snapshots, feedbacks and accesses since `begin`. No clock,
no bus.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from khala_bridge.observe import army, economy, landmarks, side
from khala_bridge.observe.body import to_tenth
from khala_bridge.observe.changes import Changes
from khala_bridge.observe.chronicle import Chronicle
from khala_bridge.observe.feedback import Feedback
from khala_bridge.observe.observation import AgentObservation, SideObservation
from khala_bridge.observe.places import Places
from khala_bridge.observe.scene import SideScene
from khala_bridge.observe.stages import Stages
from khala_bridge.observe.text import Page, render, sections_of
from khala_bridge.observe.timers import Timers
from khala_bridge.state.teams import TeamRoster
from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from khala_bridge.frames import Camera, MapFrame
    from khala_bridge.observe.image.album import Album
    from khala_bridge.observe.observation import TeamObservation
    from khala_bridge.observe.text.page import Part, Section
    from khala_bridge.state import Snapshot
    from khala_bridge.state.teams import Team
    from khala_bridge.task.config import AgentConfig, TaskConfig
    from khala_protocol.messages import Landmark, StandingView, Toll, View

Standing: TypeAlias = "Callable[[str], tuple[StandingView, ...]]"
"""Returns the standing orders of an agent, and those that have ended since it was asked."""


def _none(_agent: str) -> tuple[StandingView, ...]:
    """Return no standing orders."""
    return ()


class Observer:
    """The eyes of one side."""

    def __init__(self, task: TaskConfig, roster: Callable[[Sequence[AgentConfig]], TeamRoster] = TeamRoster) -> None:
        """Take a task, and the grouping of units into the teams of its agents.

        Raises:
            ConfigError: an agent's configuration names a section that does not exist.
        """
        self._task = task
        self._new_roster = roster
        self._configs = {agent.name: agent for agent in task.agents}
        self._sections = {agent.name: sections_of(agent) for agent in task.agents}
        self._parts = {name: _parts(sections) for name, sections in self._sections.items()}
        self._leads = any(parts & {"map", "army"} for parts in self._parts.values())
        self.begin()

    def begin(self) -> None:
        """Forget the episode before."""
        self._episode = _Episode(self._new_roster(self._task.agents))

    def observe(
        self, snapshot: Snapshot, feedback: Mapping[str, Feedback] | None = None, standing: Standing = _none
    ) -> SideObservation:
        """Return what the side sees now, with the feedback on each agent's last reply.

        An agent's observation is made on the first access through `agents`, so that one agent can think while the
        host still observes for the others. One that nobody asks for costs nothing.

        Args:
            snapshot: the state of the game.
            feedback: by agent; an agent that is not in it gets none.
            standing: returns an agent's standing orders at this moment; called when its observation is made.
        """
        episode = self._episode
        world = snapshot.info.frame(self._task.frames)
        episode.roster.update(snapshot.own, snapshot.player)
        episode.chronicle.note(snapshot)
        episode.timers.note(snapshot)
        if self._leads:
            episode.places.note(snapshot)
        episode.note_orders(feedback or {})
        teams = {name: episode.roster.teams(name) for name in self._configs}
        moment = episode.now = _Moment(self._task, snapshot, episode, teams, feedback or {}, standing)
        moment.reach(world)
        agents = _WhenAsked(self._configs, partial(self._agent, moment))
        return SideObservation(snapshot, world, self._configs, teams, dict(episode.chronicle.died), agents)

    def _agent(self, moment: _Moment, agent: AgentConfig) -> AgentObservation:
        """Return the observation of one agent, in words and pictures.

        Raises:
            RuntimeError: the side has moved on.
        """
        if self._episode.now is not moment:
            raise RuntimeError(
                f"{agent.name} was not observed at game loop {moment.snapshot.game_loop}, and that moment is over; "
                f"ask for agents[{agent.name!r}] before the next observe()"
            )
        changes = moment.since(moment.episode.last.get(agent.name, _NOTHING))
        seen = self._seen(moment, agent, changes)
        page = Page(seen, self._task, changes.conditions)
        text = render(page, self._sections[agent.name], agent.text_tokens)
        moment.episode.last[agent.name] = moment.as_last(seen)
        return replace(seen, text=text, pictures=moment.album.pictures(seen) if moment.album else ())

    def _seen(self, moment: _Moment, agent: AgentConfig, changes: Changes) -> AgentObservation:
        before = moment.episode.last.get(agent.name, _NOTHING).teams
        builds = "resources" in self._parts[agent.name] and agent.kind == "builder"
        teams = []
        for team in moment.teams[agent.name]:
            seen = moment.scene.team(agent, team, before.get(team.name), changes.events, resources=builds)
            task = moment.tasks.get((agent.name, team.name))
            teams.append(replace(seen, view=seen.view.but(task=task)) if task else seen)
        heard = moment.feedback.get(agent.name, Feedback())
        view = self._view(moment, agent, changes, teams, heard)
        idle = moment.episode.roster.idle_teams(agent.name)
        return AgentObservation(agent, moment.snapshot.game_loop, view, tuple(teams), idle, heard)

    def _view(
        self,
        moment: _Moment,
        agent: AgentConfig,
        changes: Changes,
        teams: Sequence[TeamObservation],
        heard: Feedback,
    ) -> View:
        """Return the view of an agent: the common part, its teams, and the parts that its page shows."""
        scene = moment.scene
        parts = self._parts[agent.name]
        standing = moment.standing(agent.name)
        view = scene.view.but(teams=tuple(team.view for team in teams), notes=heard.notes, standing=standing)
        more: dict[str, object] = {}
        if "counts" in parts:
            more["counts"] = side.counts(scene, moment.episode.chronicle)
        if "events" in parts:
            more["events"] = changes.of_side
        if "alerts" in parts:
            more["alerts"], more["warnings"] = side.alerts(scene, changes), side.warnings(changes)
        if "map" in parts:
            more["places"] = moment.episode.places.views(scene.snapshot, scene.world)
            more["enemy_race"] = scene.snapshot.info.enemy_race
        if "army" in parts:
            more["army"] = army.army(scene, moment.episode.places, moment.episode.chronicle)
            more["toll"] = moment.episode.toll(agent.name)
        if "economy" in parts:
            more["economy"] = economy.economy(scene, moment.episode.chronicle)
        if "others" in parts:
            more["others"] = side.others(scene, moment.teams, agent.name)
        if "power" in parts:
            more["warp_gates"] = side.warp_gates(scene)
        if marks := tuple(_landmarks(scene, parts, teams[0].camera if teams else None)):
            more["landmarks"] = marks
        return view.but(**more) if more else view


class _Last(NamedTuple):
    """What an agent's next observation needs of its last one: not the scene, so that no scene outlives its moment."""

    number: int
    """Of the side's observation, from 0."""
    totals: Mapping[str, float]
    """Health and shield of all units in sight then, by tag."""
    teams: Mapping[str, TeamObservation]
    """By name."""


_NOTHING = _Last(-1, {}, {})
"""In the place of the last observation, for an agent that had none in the episode."""


@dataclass(slots=True)
class _Episode:
    """The memory of one episode."""

    roster: TeamRoster
    chronicle: Chronicle = field(default_factory=Chronicle)
    stages: Stages = field(default_factory=Stages)
    places: Places = field(default_factory=Places)
    timers: Timers = field(default_factory=Timers)
    last: dict[str, _Last] = field(default_factory=dict)
    """By agent."""
    ordered: dict[str, tuple[int, int]] = field(default_factory=dict)
    """By agent that has given an order: number and game loop of the observation that followed the last one."""
    now: _Moment | None = None

    def note_orders(self, feedback: Mapping[str, Feedback]) -> None:
        """Take in who has given orders before the present observation."""
        for agent, heard in feedback.items():
            if heard.ordered:
                self.ordered[agent] = (self.chronicle.number, self.chronicle.loop)

    def toll(self, agent: str) -> Toll | None:
        """Return the losses since an agent's last order; None if it gave none, or just now."""
        number, loop = self.ordered.get(agent, (self.chronicle.number, 0))
        if number >= self.chronicle.number:
            return None
        return army.toll(self.chronicle, self.chronicle.since(number), loop)


@dataclass(eq=False)
class _Moment:
    """The common input of all agents' observations at one moment; what costs time is made when the first one is."""

    task: TaskConfig
    snapshot: Snapshot
    episode: _Episode
    teams: Mapping[str, Sequence[Team]]
    """By agent."""
    feedback: Mapping[str, Feedback]
    standing: Standing
    tasks: dict[tuple[str, str], str] = field(default_factory=dict)
    """By agent and team, the present task of a team with stages."""
    _changes: dict[int, Changes] = field(default_factory=dict)

    def reach(self, world: MapFrame) -> None:
        """Move the teams on to the stages that they have reached, whether anybody looks or not."""
        time_s = round(self.snapshot.game_loop / LOOPS_PER_S, 3)
        for team in (team for teams in self.teams.values() for team in teams if team.config.stages):
            head = self.snapshot.units[team.head].pos if team.tags else None
            middle = to_tenth(world.minimap(*head), world.minimap_size) if head else None
            self.tasks[team.agent, team.name] = self.episode.stages.task(team, middle, time_s)

    @cached_property
    def scene(self) -> SideScene:
        """The scene."""
        teams = (team for teams in self.teams.values() for team in teams)
        return SideScene(self.snapshot, self.task.frames, teams, self.episode.timers)

    @cached_property
    def album(self) -> Album | None:
        """The album; None if no agent has pictures, so that OpenCV is loaded only when needed."""
        if not any(agent.images for agent in self.task.agents):
            return None
        from khala_bridge.observe.image.album import Album  # noqa: PLC0415  # see above

        return Album(self.snapshot, self.scene.world)

    def since(self, last: _Last) -> Changes:
        """Return the changes since an agent's last observation; agents with the same one share them."""
        if last.number not in self._changes:
            log = self.episode.chronicle.since(last.number)
            self._changes[last.number] = Changes(last.totals, self.scene, log)
        return self._changes[last.number]

    def as_last(self, seen: AgentObservation) -> _Last:
        """Return what an agent's next observation needs of this one."""
        return _Last(self.episode.chronicle.number, self.scene.totals, {team.name: team for team in seen.teams})


class _WhenAsked(Mapping[str, AgentObservation]):
    """The observation of each agent, in the order of the task; made on first access."""

    def __init__(self, agents: Mapping[str, AgentConfig], make: Callable[[AgentConfig], AgentObservation]) -> None:
        self._agents = agents
        self._make = make
        self._made: dict[str, AgentObservation] = {}

    def __getitem__(self, name: str) -> AgentObservation:
        if name not in self._made:
            self._made[name] = self._make(self._agents[name])
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._agents)

    def __len__(self) -> int:
        return len(self._agents)


def _parts(sections: Sequence[Section]) -> frozenset[Part]:
    return frozenset(part for section in sections for part in section.parts)


def _landmarks(scene: SideScene, parts: frozenset[Part], camera: Camera | None) -> Iterator[Landmark]:
    if "structures" in parts:
        yield from landmarks.structures(scene)
    if "power" in parts:
        yield from landmarks.power_fields(scene, camera)
    if "places" in parts:
        yield from landmarks.free_places(scene, camera)
