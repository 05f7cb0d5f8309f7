"""A task: a map, the agents that play it, their units, and their actions.

The model of the files in `configs/tasks/`. Reading checks it against the map table, the catalogue and PySC2's unit
names, so that a wrong name is an error with its line, not a surprise in the game. It holds no state:
`khala_bridge.state.teams` knows the units of each team in a running game.
"""

from __future__ import annotations

from collections import Counter
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Annotated, Literal, Self, TypeAlias, TypeVar

from pydantic import AfterValidator, Field, field_validator, model_validator

from khala_bridge.catalogue.action import GROUP_SELECTOR, Action
from khala_bridge.catalogue.catalogue import alias_of, catalogue, chosen
from khala_bridge.knowledge import knowledge
from khala_bridge.knowledge.forms import forms_of
from khala_bridge.task.images import ImageSpec  # noqa: TC001  # pydantic evaluates it
from khala_bridge.task.maps import MOST_LOOPS, Difficulty, MapSpec, Race, known_maps
from khala_protocol.configfile import UnknownName
from khala_protocol.errors import WrongKey
from khala_protocol.keys import check_name
from khala_protocol.messages import AgentCard, Clock, Frames, Frozen, Point, TeamSpec

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

T = TypeVar("T")

MOST_ACTIONS = 1000
"""Actions for one team in one reply; 128 teams with 27 each are carried out in one step."""
TeamKind: TypeAlias = Literal["select", "select_all_type", "group", "side"]
AgentKind: TypeAlias = Literal["combat_group", "commander", "developer", "builder"]
Admission: TypeAlias = Literal["combat", "builder", "defender", "airborne", "any"]


def _key_name(name: str) -> str:
    try:
        return check_name(name)
    except WrongKey as error:
        raise ValueError(str(error)) from None


def _known(name: str, known: Collection[str], what: str) -> str:
    if name in known:
        return name
    raise UnknownName(what, name, known)


def _known_action(name: str) -> str:
    """Return the name of an action in the catalogue's spelling; names of groups are checked later, with their owner."""
    if name.startswith(GROUP_SELECTOR):
        return name
    action = alias_of(name)
    return action.name if action else _known(name, catalogue(), "action")


def _of_forms(actions: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """Return the actions of the forms of some types: those of the type that the form has as well."""
    return {
        form: tuple(name for name in chosen(names, form) if catalogue()[name].fits(form))
        for unit_type, names in actions.items()
        for form in forms_of(unit_type)
    }


def _some(values: tuple[T, ...]) -> tuple[T, ...]:
    """Return at least one value; pydantic's `min_length` would hide the errors of the present values."""
    if not values:
        raise ValueError("at least one is needed")
    return values


KeyName: TypeAlias = Annotated[str, AfterValidator(_key_name)]
UnitTypeName: TypeAlias = Annotated[str, AfterValidator(lambda name: _known(name, knowledge(), "unit type"))]
ActionName: TypeAlias = Annotated[str, AfterValidator(_known_action)]
MapName: TypeAlias = Annotated[str, AfterValidator(lambda name: name and _known(name, known_maps(), "map"))]


class Stage(Frozen):
    """One part of a team's task, until the next one begins; the last part stays."""

    task: str
    at: Point | None = None
    """Place on the minimap that ends the stage when the middle of the team's screen is there."""
    within: float = Field(default=4.0, gt=0)
    """Cells of the minimap that count as being there."""
    until_s: float | None = Field(default=None, ge=0)
    """Time on the game's clock that ends the stage, in seconds."""


class TeamConfig(Frozen):
    """One team of an agent."""

    name: KeyName
    unit_types: tuple[UnitTypeName, ...] = ()
    kind: TeamKind = "group"
    """`select`: every unit is a team of its own, named `<name>-1`, `<name>-2`, …; `select_all_type`: the units of
    a type around the first one; `group`: a control group, units are spread over the agent's teams; `side`: no units,
    but orders to units of the whole side, its producers, workers or army, which the host chooses."""
    actions: tuple[ActionName, ...] = ()
    """Actions of a team of the kind `side`; `group:<name>` stands for a whole group of actions."""
    control_group: int | None = Field(default=None, ge=0, le=9)
    """Control group that the screen executor keeps the team in; without one it selects unit by unit."""
    task: str = ""
    """Its task for all the time."""
    stages: tuple[Stage, ...] = ()
    """Further tasks, one after the other."""

    @field_validator("stages")
    @classmethod
    def _stages_end(cls, stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
        if any(stage.at is None and stage.until_s is None for stage in stages[:-1]):
            raise ValueError("every stage but the last one needs an end: give at or until_s")
        return stages

    @field_validator("actions")
    @classmethod
    def _of_the_side(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        names = chosen(names)
        if strange := [name for name in names if catalogue()[name].subject != "side" and catalogue()[name].function]:
            raise ValueError(f"{strange[0]} is for units, and this is for the whole side")
        return names

    @model_validator(mode="after")
    def _units_or_side(self) -> Self:
        if self.kind == "side":
            if self.unit_types or not self.actions:
                raise ValueError(f"team {self.name} is of the kind side: it has actions and no unit_types")
        elif self.actions or not self.unit_types:
            raise ValueError(f"team {self.name} needs unit_types; their actions are listed by type of unit")
        return self


class AutoConfig(Frozen):
    """Orders that the host gives by itself, to units that no agent has ordered in the same turn."""

    gather: bool = False
    """Send idle workers to minerals and gas."""
    train_workers: bool = False
    """Train workers while bases have room for them."""
    warpgates: bool = False
    """Turn Gateways into WarpGates once that is researched."""


class AgentConfig(Frozen):
    """One agent: its name, its teams, and the actions of each type of unit."""

    name: KeyName
    role: str
    kind: AgentKind = "combat_group"
    """Its role; decides on the sections of its observations unless `sections` does."""
    sections: tuple[str, ...] = ()
    """Names of the [sections](observations.md) of its observations, in their order; () for those of its kind.
    `my_module:mine` is one that a module of yours registers."""
    images: tuple[ImageSpec, ...] = ()
    text_tokens: int | None = Field(default=None, ge=100)
    """Approximate limit of tokens of its observations; None for no limit. Longer ones leave things out and say so."""
    talks_to: tuple[KeyName, ...] | None = None
    """Agents that it may write to; None for all."""
    admits: Admission = "combat"
    """Units that it takes of those that its teams list; see `khala_bridge.state.teams`."""
    teams: tuple[TeamConfig, ...] = ()
    """One or more; a commander may have none, and only talk."""
    actions: dict[UnitTypeName, tuple[ActionName, ...]] = Field(default_factory=dict)
    """Names of text actions by unit type, in the order in which they are shown; `group:<name>` stands for those of a
    group that the type has. A form (sieged, burrowed, …) that is not listed has the actions of its type."""
    task: str = ""
    """Its task in addition to the task of all."""
    max_actions: int | None = Field(default=None, ge=1, le=MOST_ACTIONS)
    """Limit of actions for one of its teams in one reply; None for the task's limit."""
    required: bool = True
    """Whether the match waits for it at the start."""

    @field_validator("actions")
    @classmethod
    def _actions(cls, actions: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
        actions = {unit_type: tuple(dict.fromkeys(names)) for unit_type, names in actions.items()}
        found = {unit_type: chosen(names, unit_type) for unit_type, names in actions.items()}
        for unit_type, names in found.items():
            if strange := [name for name in names if not catalogue()[name].fits(unit_type)]:
                raise ValueError(f"{unit_type} has no action {strange[0]}")
        return found | {form: names for form, names in _of_forms(actions).items() if form not in found}

    @model_validator(mode="after")
    def _every_type_has_actions(self) -> Self:
        _once((team.name for team in self.teams), "team")
        if not self.teams and self.kind != "commander":
            raise ValueError(f"agent {self.name} needs a team; only a commander may have none")
        for team in self.teams:
            if missing := [name for name in team.unit_types if name not in self.actions]:
                raise ValueError(f"team {team.name} has units of type {missing[0]}, for which no actions are listed")
        return self

    def catalogue(self) -> tuple[Action, ...]:
        """Return every action of any of its units, in the order in which they are first listed."""
        lists = (*(team.actions for team in self.teams), *self.actions.values())
        names = dict.fromkeys(name for listed in lists for name in listed)
        return tuple(catalogue()[name] for name in names)

    def team_specs(self) -> tuple[TeamSpec, ...]:
        """Return its teams as its briefing describes them."""
        return tuple(TeamSpec(name=t.name, unit_types=t.unit_types, task=t.task) for t in self.teams)


class Opponent(Frozen):
    """The computer player; values that are missing come from the map table."""

    race: Race | None = None
    difficulty: Difficulty | None = None


class TaskConfig(Frozen):
    """The map, the agents, and the rules of a match."""

    name: KeyName
    description: str = ""
    map: MapName = ""
    own_map: MapSpec | None = None
    """Instead of `map`: one that is not in the table, such as a scenario of your own."""
    race: Race | None = None
    """The agents' race; None for the map's own."""
    opponent: Opponent = Opponent()
    side: KeyName = "blue"
    """Name of the agents' side in keys and reports."""
    task: str
    """The task of all agents."""
    agents: Annotated[tuple[AgentConfig, ...], AfterValidator(_some)]
    channels: tuple[str, ...] = ()
    """Names for groups of agents that can receive messages."""
    communication: bool = True
    """Whether agents may write to each other."""
    executor: Literal["raw", "screen"] = "raw"
    clock: Clock = Clock()
    frames: Frames = Frames()
    auto: AutoConfig = AutoConfig()
    default_reply: str = ""
    """Reply of an agent that did not answer in time; empty: its units continue."""
    max_actions: int = Field(default=3, ge=1, le=MOST_ACTIONS)
    """Limit of actions for one team in one reply."""
    max_steps: int | None = Field(default=None, ge=1, le=MOST_LOOPS)
    """Decisions after which an episode ends without a result; None: the map decides."""

    @field_validator("clock")
    @classmethod
    def _clock(cls, clock: Clock) -> Clock:
        if clock.rule != "frozen":
            raise ValueError(f"the clock rule '{clock.rule}' is not there yet, only 'frozen' is")
        return clock

    @field_validator("agents")
    @classmethod
    def _agents(cls, agents: tuple[AgentConfig, ...]) -> tuple[AgentConfig, ...]:
        _once((agent.name for agent in agents), "agent")
        names = [agent.name for agent in agents]
        for agent in agents:
            for name in agent.talks_to or ():
                _known(name, names, "agent")
        groups = [t.control_group for a in agents for t in a.teams if t.control_group is not None]
        _once((str(group) for group in groups), "control group")
        return agents

    @model_validator(mode="after")
    def _one_map(self) -> Self:
        if bool(self.map) == (self.own_map is not None):
            raise ValueError("give either map or own_map")
        return self

    @property
    def map_spec(self) -> MapSpec:
        """The map, with this task's changes."""
        changed = {"race": self.race, "opponent": self.opponent.race, "difficulty": self.opponent.difficulty}
        if self.own_map is None:
            spec = known_maps()[self.map]
        else:
            spec = self.own_map.model_copy(update={"name": self.own_map.name or PurePosixPath(self.own_map.file).stem})
        return spec.model_copy(update={k: v for k, v in changed.items() if v is not None})

    @property
    def render_px(self) -> int | None:
        """Size of the pictures that the game itself must render; None for none."""
        sizes = [image.size_px for agent in self.agents for image in agent.images if image.is_rendered]
        return max(sizes, default=None)

    def agent(self, name: str) -> AgentConfig:
        """Return the agent of this name."""
        return next(agent for agent in self.agents if agent.name == name)

    def max_actions_of(self, agent: AgentConfig) -> int:
        """Return the limit of actions for one team of an agent in one reply."""
        return self.max_actions if agent.max_actions is None else agent.max_actions

    def correspondents(self, agent: AgentConfig) -> tuple[AgentConfig, ...]:
        """Return the agents that this one may write to, in the order of the task."""
        if not self.communication:
            return ()
        names = agent.talks_to
        return tuple(a for a in self.agents if a.name != agent.name and (names is None or a.name in names))

    def cards(self) -> tuple[AgentCard, ...]:
        """Return the agents as the run card lists them."""
        return tuple(
            AgentCard(name=a.name, side=self.side, teams=tuple(t.name for t in a.teams), required=a.required)
            for a in self.agents
        )


def _once(names: Iterable[str], what: str) -> None:
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise ValueError(f"there are two of {what} {twice[0]}")
