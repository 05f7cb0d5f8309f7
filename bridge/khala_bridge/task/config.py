"""A task: a map, the agents that play it, their units, and their actions.

The model of the files in `configs/tasks/`. Reading checks it against the map table, the catalogue and PySC2's unit
names, so that a wrong name is an error with its line, not a surprise in the game. It holds no state:
`khala_bridge.state.teams` knows the units of each team in a running game.
"""

from __future__ import annotations

import math
from collections import Counter
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self, TypeAlias, TypeVar

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from khala_bridge.catalogue.action import GROUP_SELECTOR, Action
from khala_bridge.catalogue.catalogue import alias_of, catalogue, chosen
from khala_bridge.knowledge import knowledge
from khala_bridge.knowledge.forms import forms_of
from khala_bridge.task.images import ImageSpec  # noqa: TC001  # pydantic evaluates it
from khala_bridge.task.maps import MOST_LOOPS, MapSpec, Race, known_maps
from khala_bridge.task.opponent import Opponent, opponent_of
from khala_bridge.task.variant import PapersTask, Stage
from khala_protocol.configfile import UnknownName
from khala_protocol.errors import WrongKey
from khala_protocol.keys import check_name
from khala_protocol.messages import (
    LOOPS_PER_S,
    ActionSpec,
    AgentCard,
    AgentKind,
    Clock,
    Frames,
    Frozen,
    MemoryRule,
    TeamSpec,
    Trigger,
    Variant,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from khala_bridge.knowledge import DataSet

T = TypeVar("T")

MOST_ACTIONS = 1000
"""Actions for one team in one reply; 128 teams with 27 each are carried out in one step."""
MOST_STANDING = 20
"""Standing orders of one team; each is judged in every step."""
TeamKind: TypeAlias = Literal["select", "select_all_type", "group", "side"]
Asking: TypeAlias = Literal["needed", "always"]
Rhythm: TypeAlias = Literal["own", "paper"]
PAPERS_RHYTHM: Final[dict[str, dict[str, Any]]] = {
    "clock": {"step_loops": math.ceil(LOOPS_PER_S)},
    "auto": {"gather": True, "train_workers": True},
}
"""What `rhythm: paper` sets: at most one decision in a second of the game, and workers as LLM-PySC2 trains them."""
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
    """Whether the match waits for it, at the start and while it is away."""
    ask: Asking = "needed"
    """`needed`: not while its teams have no units, unless somebody wrote to it. Agents with a team of the kind `side`,
    and those without teams, are always needed. `always`: without units, too."""
    every_loops: int = Field(default=0, ge=0, le=100_000)
    """Game loops that pass at least between two of its observations."""
    memory: MemoryRule | None = None
    """What it knows of the steps before, instead of what the task says."""
    when: tuple[Trigger, ...] = ()
    """What has it asked at once, even before `every_loops` have passed: `attacked` (a unit of its teams lost health or
    died), `idle` (one of them has no order), `message` (somebody wrote to it). Without `every_loops`, nothing else."""

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

    def specs(self) -> tuple[ActionSpec, ...]:
        """Return its catalogue as its briefing lists it."""
        return tuple(action.spec for action in self.catalogue())

    def team_specs(self) -> tuple[TeamSpec, ...]:
        """Return its teams as its briefing describes them."""
        return tuple(TeamSpec(name=t.name, unit_types=t.unit_types, task=t.task) for t in self.teams)


def _team_mates(agents: tuple[AgentConfig, ...]) -> tuple[AgentConfig, ...]:
    """Return agents whose names and control groups agree."""
    _once((agent.name for agent in agents), "agent")
    names = [agent.name for agent in agents]
    for agent in agents:
        for name in agent.talks_to or ():
            _known(name, names, "agent")
    groups = [t.control_group for a in agents for t in a.teams if t.control_group is not None]
    _once((str(group) for group in groups), "control group")
    return agents


Agents: TypeAlias = Annotated[tuple[AgentConfig, ...], AfterValidator(_team_mates)]


class SideConfig(Frozen):
    """One of two sides: its name, and the fields in which it differs from what the task gives both of them."""

    side: KeyName
    race: Race | None = None
    task: str | None = None
    agents: Annotated[Agents, AfterValidator(_some)] | None = None
    channels: tuple[str, ...] | None = None
    communication: bool | None = None
    advisers: tuple[AdviserConfig, ...] | None = None
    auto: AutoConfig | None = None
    default_reply: str | None = None
    max_actions: int | None = Field(default=None, ge=1)
    memory: MemoryRule | None = None
    standing_orders: int | None = Field(default=None, ge=0, le=MOST_STANDING)


class AdviserConfig(Frozen):
    """Somebody outside the match who may write to agents, see [advise](../how-to/advise.md)."""

    name: KeyName
    role: str = Field(default="adviser", min_length=1, max_length=60, pattern=r"^[^\x00-\x1f()]+$")
    """What agents read beside the name."""


class FaultRules(Frozen):
    """What the host does when a part of a match fails; see [faults](../how-to/faults.md)."""

    agent_gone: Literal["wait", "go_on", "end"] = "wait"
    """A required agent went away, or the host's link did: hold the game for the clock's `grace_s` and then end the
    match, go on without the agent, or end the match at once."""
    game_lost: Literal["restart", "end"] = "restart"
    """The game died or does not answer: start it again and play the recorded decisions into it, or end the match. Only
    the simulator can be restarted, and only with a recording."""
    undecided: float = Field(default=0.1, ge=0, le=1)
    """The part of its decisions that a required agent may leave to a fallback or to nobody: its model did not answer,
    or too late, or without a word. With more, the episode is not valid; 1 for no limit but that it decides once."""
    recording_lost: Literal["end", "go_on"] = "end"
    """The recording cannot be written, because the disk is full for example."""


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
    """Also in one line, as on the command line: `guest:python run.py`."""
    side: KeyName = "blue"
    """Name of the agents' side in keys and reports."""
    sides: tuple[SideConfig, ...] = ()
    """Two, if agents play against agents. The other fields hold for both, unless a side has its own."""
    task: str = Field(default=None, validate_default=True)
    """The task of all agents; required, unless each side has its own."""
    agents: Agents = Field(default=None, validate_default=True)
    """One or more; required, unless each side has its own."""
    channels: tuple[str, ...] = ()
    """Names for groups of agents that can receive messages."""
    communication: bool = True
    """Whether agents may write to each other."""
    advisers: tuple[AdviserConfig, ...] = (AdviserConfig(name="Adviser"),)
    """People or programs who may write to agents in the match; `[]` if nobody may. The recording marks what they
    write, and the result counts it."""
    scenes: Literal["whole", "seen", "none"] = "whole"
    """What the host tells those who watch of the map in each step, never agents: the whole map without fog, where the
    game shows it; what the sides see together; or nothing. See [scenes](../how-to/read-a-recording.md#the-map)."""
    variant: Variant = "files"
    """Of a task of LLM-PySC2: `files` as its published maps and files play it, `paper` as its paper says. The list of
    [tasks](tasks.md) says where the two differ."""
    paper: PapersTask = PapersTask()
    """What is different with `variant: paper`."""
    executor: Literal["raw", "screen"] = "raw"
    rhythm: Rhythm = "own"
    """`paper`: at most one decision in a second of the game, and workers that gather and are trained by the host, as in
    LLM-PySC2, whatever `clock` and `auto` say of that; so that results can be compared with its tables in principle."""
    clock: Clock = Clock()
    frames: Frames = Frames()
    auto: AutoConfig = AutoConfig()
    faults: FaultRules = FaultRules()
    default_reply: str = ""
    """Reply of an agent that did not answer in time; empty: its units continue."""
    max_actions: int = Field(default=3, ge=1, le=MOST_ACTIONS)
    """Limit of actions for one team in one reply."""
    memory: MemoryRule = MemoryRule()
    """What agents know of the steps before, see [memory](../how-to/memory.md)."""
    standing_orders: int = Field(default=0, ge=0, le=MOST_STANDING)
    """Standing orders that one team may have, see [memory](../how-to/memory.md#standing-orders)."""
    max_steps: int | None = Field(default=None, ge=1, le=MOST_LOOPS)
    """Decisions after which an episode ends without a result; None: the map decides."""

    @model_validator(mode="before")
    @classmethod
    def _in_rhythm(cls, fields: Any) -> Any:
        if not isinstance(fields, dict) or fields.get("rhythm") != "paper":
            return fields
        return fields | {name: _with(fields.get(name), preset) for name, preset in PAPERS_RHYTHM.items()}

    @model_validator(mode="before")
    @classmethod
    def _in_variant(cls, fields: Any) -> Any:
        if not isinstance(fields, dict) or fields.get("variant") != "paper":
            return fields
        try:
            return PapersTask.model_validate(fields.get("paper", {})).over(fields)
        except ValueError:  # its own field says what is wrong
            return fields

    @field_validator("sides")
    @classmethod
    def _two(cls, sides: tuple[SideConfig, ...]) -> tuple[SideConfig, ...]:
        if len(sides) not in (0, 2):
            raise ValueError(f"there are {len(sides)} sides: give two, or none for one side against the computer")
        _once((side.side for side in sides), "side")
        return sides

    @field_validator("opponent", mode="before")
    @classmethod
    def _in_one_line(cls, value: object) -> object:
        return opponent_of(value) if isinstance(value, str) else value

    @field_validator("task", "agents", mode="before")
    @classmethod
    def _given(cls, value: object, info: ValidationInfo) -> object:
        field = str(info.field_name)
        if value not in (None, [], ()):
            return value
        sides = info.data.get("sides", ())
        if sides and all(getattr(side, field) is not None for side in sides):
            return () if field == "agents" else ""
        raise PydanticCustomError("missing", "Field required")

    @model_validator(mode="after")
    def _one_map(self) -> Self:
        if bool(self.map) == (self.own_map is not None):
            raise ValueError("give either map or own_map")
        return self

    @model_validator(mode="after")
    def _two_variants(self) -> Self:
        if self.variant == "paper" and not self.has_variants:
            raise ValueError(f"the paper says nothing else of {self.name} than its files: leave out variant")
        return self

    @model_validator(mode="after")
    def _participants(self) -> Self:
        for side in self.per_side():
            names = [agent.name for agent in side.agents] + [adviser.name for adviser in side.advisers]
            _once(map(str.casefold, names), "agent or adviser")
        return self

    @model_validator(mode="after")
    def _room_for_another(self) -> Self:
        if (self.sides or self.opponent.joins) and not self._map.two_sides:
            another = "second side of agents" if self.sides else "player who joins"
            raise ValueError(f"the map {self._map.name} has no place for a {another}")
        return self

    @model_validator(mode="after")
    def _nobody_else(self) -> Self:
        if self.sides and self.opponent != Opponent():
            raise ValueError("a task of two sides has no opponent: give the race of each side in `sides`")
        if self.sides and self.side != type(self).model_fields["side"].default:
            raise ValueError("a task of two sides has no side of its own: name both in `sides`")
        return self

    @model_validator(mode="after")
    def _races(self) -> Self:
        spec = self._map
        asked = [self.race, *(side.race for side in self.sides)]
        if strange := [race for race in asked if race not in (None, spec.race)] if not spec.any_race else []:
            raise ValueError(f"the units of the map {spec.name} are {spec.race}: the race cannot be {strange[0]}")
        return self

    @property
    def map_spec(self) -> MapSpec:
        """The map, with this task's changes; the opponent of two sides is the second one."""
        race, opponent = self.race, self.opponent.race
        if self.sides:
            race, opponent = (side.race or self.race for side in self.sides)
        changed = {"race": race, "opponent": opponent, "difficulty": self.opponent.difficulty}
        return self._map.model_copy(update={k: v for k, v in changed.items() if v is not None})

    @property
    def map_data(self) -> DataSet:
        """The data that the map depends on, see `khala_bridge.knowledge.facts_of`."""
        return (self.own_map or known_maps()[self.map]).data

    @property
    def has_variants(self) -> bool:
        """Whether the paper and its files differ in this task, so that there is a choice."""
        return self.paper != PapersTask() or bool(self.map and known_maps()[self.map].paper)

    @property
    def _map(self) -> MapSpec:
        """The map as it is, of the task's variant."""
        if self.own_map is None:
            spec = known_maps()[self.map]
            return spec.as_in_paper() if self.variant == "paper" else spec
        return self.own_map.model_copy(update={"name": self.own_map.name or PurePosixPath(self.own_map.file).stem})

    @property
    def against(self) -> str:
        """Who the agents play against, as far as the task says; "" if there are two sides of agents."""
        return "" if self.sides else self.opponent.against(self.map_spec)

    def per_side(self) -> tuple[TaskConfig, ...]:
        """Return the task of each side, as if the other one were an opponent; itself if there is only one."""
        if not self.sides:
            return (self,)
        spec = self.map_spec
        first, second = self.sides
        return self._task_of(first, spec.race, spec.opponent), self._task_of(second, spec.opponent, spec.race)

    def _task_of(self, side: SideConfig, race: Race | None, other: Race | None) -> TaskConfig:
        own = {name: value for name in SideConfig.model_fields if (value := getattr(side, name)) is not None}
        return self.model_copy(update=own | {"sides": (), "race": race, "opponent": Opponent(race=other)})

    @property
    def render_px(self) -> int | None:
        """Size of the pictures that the game itself must render; None for none."""
        agents = (agent for task in self.per_side() for agent in task.agents)
        return max((image.size_px for agent in agents for image in agent.images if image.is_rendered), default=None)

    def agent(self, name: str) -> AgentConfig:
        """Return the agent of this name."""
        return next(agent for agent in self.agents if agent.name == name)

    def max_actions_of(self, agent: AgentConfig) -> int:
        """Return the limit of actions for one team of an agent in one reply."""
        return self.max_actions if agent.max_actions is None else agent.max_actions

    def memory_of(self, agent: AgentConfig) -> MemoryRule:
        """Return what an agent knows of the steps before."""
        return self.memory if agent.memory is None else agent.memory

    def correspondents(self, agent: AgentConfig) -> tuple[AgentConfig, ...]:
        """Return the agents that this one may write to, in the order of the task."""
        if not self.communication:
            return ()
        names = agent.talks_to
        return tuple(a for a in self.agents if a.name != agent.name and (names is None or a.name in names))

    def cards(self) -> tuple[AgentCard, ...]:
        """Return the agents of all sides as the run card lists them."""
        return tuple(
            AgentCard(
                name=a.name,
                side=task.side,
                teams=tuple(t.name for t in a.teams),
                required=a.required,
                pictures=tuple(dict.fromkeys(image.what for image in a.images)),
            )
            for task in self.per_side()
            for a in task.agents
        )


def _with(given: object, preset: Mapping[str, Any]) -> object:
    """Return a part of a task's fields with some of them set; one that is wrong stays, for its own error."""
    if isinstance(given, Frozen):
        return {**given.model_dump(), **preset}
    return {**given, **preset} if isinstance(given, dict) else preset if given is None else given


def _once(names: Iterable[str], what: str) -> None:
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise ValueError(f"there are two of {what} {twice[0]}")
