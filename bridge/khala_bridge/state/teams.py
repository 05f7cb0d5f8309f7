"""The rules of grouping: the agent and the team of each unit.

A unit is grouped when it is first seen finished, in ascending order of tags, and stays in its team until it is gone.
A unit that comes back (out of a transport, a gas building) returns to its old team. Structures are units like all
others: the agent that lists their type has them. Units that no team lists belong to no agent.

*Agent*: one that admits only `airborne` units, if the unit stands by a transport; otherwise the first agent in
the order of the task that lists its type and admits it:

| admits | takes |
|---|---|
| `combat` | everything; of workers only one, as a scout, while it has no other unit |
| `builder` | units, while it has fewer than workers of the player / 30 |
| `defender` | units, while it has fewer than supply of the player's army / 15 |
| `airborne` | units that stand less than 4 from an own transport |
| `any` | everything |

*Team*, of the agent's teams that list the type: the first, if all of them are empty; then by kind: `group` takes
the smallest team while that has fewer than 4 units, and later the one whose head is nearest; the others take the
nearest head within 15, else an empty team, else the nearest head. A `side` team has no units and is always there.

*Change of type* (a Gateway becomes a WarpGate, a tank digs in): the unit stays, if its team lists the new type;
otherwise it goes to a team that does. If none does, a unit in another form (burrowed, sieged, lifted off, in a
cocoon) counts as the type whose form it is, and any other unit belongs to no agent from then on. A unit out of an egg,
and the Archon of two Templar, is a new unit to the game and is grouped as one.

The head of a team is its oldest unit. (In the original the order of a Python set decided, so that the camera jumped.)
Sources of the rules: the paper's appendix D and its first implementation; the rule of changes is our own; see
SOURCES.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_bridge.knowledge import WORKERS
from khala_bridge.knowledge.forms import form_of
from khala_bridge.names import unit_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from khala_bridge.state import PlayerState, Unit
    from khala_bridge.task.config import AgentConfig, TeamConfig, TeamKind

TRANSPORTS = frozenset({"WarpPrism", "WarpPrismPhasing", "Medivac", "OverlordTransport"})
SMALL_GROUP = 4
NEAR_HEAD = 15.0
NEAR_TRANSPORT = 4.0
WORKERS_PER_BUILDER = 30
ARMY_PER_DEFENDER = 15


@dataclass(frozen=True, slots=True)
class Team:
    """A team as agents name it, with its present units."""

    agent: str
    name: str
    kind: TeamKind
    tags: tuple[int, ...]
    """Its units, the head first; () for a `side` team."""
    control_group: int | None
    config: TeamConfig

    @property
    def head(self) -> int:
        """Tag of the unit that the team's camera follows; a `side` team has none."""
        return self.tags[0]


class TeamRoster:
    """The units of each team in a running episode; one roster per side."""

    def __init__(self, agents: Iterable[AgentConfig]) -> None:
        self._groups = [[_Group(agent, team) for team in agent.teams] for agent in agents]
        self._homes: dict[int, _Home] = {}
        self._grouped: set[int] = set()
        self._takers: dict[int, list[list[_Group]]] = {}  # by unit type; [] for a type that no team lists

    def update(self, own: Sequence[Unit], player: PlayerState) -> None:
        """Drop the units that are gone and add new ones to their teams; `own` in ascending order of tags."""
        units = {unit.tag: unit for unit in own}
        self._keep(units)
        transports: list[Unit] | None = None
        for tag, unit in units.items():
            if tag in self._grouped or not self._taken_by(unit.unit_type) or unit.build_progress < 1.0:
                continue
            if transports is None:
                transports = [u for u in own if u.name in TRANSPORTS]
            self._place(_Arrival(unit, units, transports, player))

    def teams(self, agent: str) -> tuple[Team, ...]:
        """Return the agent's teams that have units, and its `side` teams, in the order of its configuration."""
        return tuple(team for group in self._all_groups() if group.agent.name == agent for team in group.teams())

    def idle_teams(self, agent: str) -> tuple[str, ...]:
        """Return the names of the agent's teams that could have units and have none now."""
        groups = (group for group in self._all_groups() if group.agent.name == agent and group.config.kind != "side")
        return tuple(group.config.name for group in groups if not group.tags)

    def _all_groups(self) -> Iterator[_Group]:
        return (group for groups in self._groups for group in groups)

    def _keep(self, units: Mapping[int, Unit]) -> None:
        """Keep the units in the teams that are still there with their old type; release units of a new type."""
        for tag in self._grouped & units.keys():
            home = self._homes[tag]
            unit_type = units[tag].unit_type
            if home.unit_type != unit_type:
                if _lists(self._taken_by(unit_type), home.group):
                    home.unit_type = unit_type
                else:
                    del self._homes[tag]
        for group in self._all_groups():
            group.tags = [tag for tag in group.tags if tag in units and tag in self._homes]
        self._grouped = {tag for group in self._all_groups() for tag in group.tags}

    def _place(self, arrival: _Arrival) -> None:
        tag, unit_type = arrival.unit.tag, arrival.unit.unit_type
        home = self._homes.get(tag)
        takers = self._taken_by(unit_type)
        if home is not None and _lists(takers, home.group):
            group: _Group | None = home.group
        else:
            group = _find(takers, arrival)
        if group is not None:
            self._homes[tag] = _Home(group, unit_type)
            self._grouped.add(tag)
            group.add(tag)

    def _taken_by(self, unit_type: int) -> list[list[_Group]]:
        """Return the groups that list a unit type, agent by agent."""
        if unit_type not in self._takers:
            name: str | None = unit_name(unit_type)
            takers: list[list[_Group]] = []
            while name is not None and not takers:
                found = ([g for g in groups if name in g.config.unit_types] for groups in self._groups)
                takers = [groups for groups in found if groups]
                name = form_of(name)
            self._takers[unit_type] = takers
        return self._takers[unit_type]


@dataclass(slots=True)
class _Group:
    """A configured team and its units in the order in which they came."""

    agent: AgentConfig
    config: TeamConfig
    tags: list[int] = field(default_factory=list)
    numbers: dict[int, int] = field(default_factory=dict)
    """Number of every unit that it ever had; the number of a dead unit is not used again."""

    def add(self, tag: int) -> None:
        self.tags.append(tag)
        self.numbers.setdefault(tag, len(self.numbers) + 1)

    def teams(self) -> Iterator[Team]:
        name, kind, agent = self.config.name, self.config.kind, self.agent.name
        if kind == "side":
            yield Team(agent, name, kind, (), None, self.config)
        elif kind == "select":
            for tag in self.tags:
                yield Team(agent, f"{name}-{self.numbers[tag]}", kind, (tag,), None, self.config)
        elif self.tags:
            yield Team(agent, name, kind, tuple(self.tags), self.config.control_group, self.config)


@dataclass(slots=True)
class _Home:
    """The group of a unit, and its type when that was last checked."""

    group: _Group
    unit_type: int


@dataclass(frozen=True, slots=True)
class _Arrival:
    """A unit without a team, and its surroundings."""

    unit: Unit
    units: Mapping[int, Unit]
    transports: Sequence[Unit]
    player: PlayerState


def _lists(takers: Iterable[Sequence[_Group]], group: _Group) -> bool:
    return any(taker is group for groups in takers for taker in groups)


def _find(takers: Sequence[Sequence[_Group]], arrival: _Arrival) -> _Group | None:
    """Return the group that takes a unit: first agents of airborne units, then all others, in their order."""
    for airborne in (True, False):
        for groups in takers:
            if (groups[0].agent.admits == "airborne") == airborne and _admits(groups, arrival):
                return _choose(groups, arrival)
    return None


def _admits(groups: Sequence[_Group], arrival: _Arrival) -> bool:
    unit, player = arrival.unit, arrival.player
    has = sum(len(group.tags) for group in groups)
    match groups[0].agent.admits:
        case "combat":
            return has == 0 or unit.name not in WORKERS
        case "builder":
            return has < player.food_workers / WORKERS_PER_BUILDER
        case "defender":
            return has < player.food_army / ARMY_PER_DEFENDER
        case "airborne":
            return any(t.tag == unit.tag or _distance(unit, t) < NEAR_TRANSPORT for t in arrival.transports)
        case "any":
            return True


def _choose(groups: Sequence[_Group], arrival: _Arrival) -> _Group:
    if not any(group.tags for group in groups):
        return groups[0]
    unit, units = arrival.unit, arrival.units
    smallest = min(groups, key=lambda group: len(group.tags))
    nearest = min((g for g in groups if g.tags), key=lambda group: _distance(unit, units[group.tags[0]]))
    if groups[0].config.kind == "group":
        return smallest if len(smallest.tags) < SMALL_GROUP else nearest
    if _distance(unit, units[nearest.tags[0]]) < NEAR_HEAD:
        return nearest
    return nearest if smallest.tags else smallest


def _distance(a: Unit, b: Unit) -> float:
    return math.dist(a.pos, b.pos)
