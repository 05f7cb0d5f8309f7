"""Which unit answers to which agent and team: the one home of the rules of grouping.

A unit is grouped when it is seen finished for the first time, in ascending order of tags, and stays where it is
until it is gone. A unit that comes back (out of a transport, a gas building) returns to its old team.

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
nearest head within 15, else an empty team, else the nearest head.

The head of a team is its oldest unit. (The order of a Python set decided it in the original, so that the camera
jumped.) Sources of the rules: the paper's appendix D and its first implementation; see SOURCES.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bridge.names import unit_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from s2clientprotocol import raw_pb2
    from s2clientprotocol import sc2api_pb2 as sc_pb

    from bridge.task import AgentConfig, TeamConfig, TeamKind

WORKERS = frozenset({"Probe", "SCV", "Drone", "MULE"})
TRANSPORTS = frozenset({"WarpPrism", "WarpPrismPhasing", "Medivac", "OverlordTransport"})
SMALL_GROUP = 4
NEAR_HEAD = 15.0
NEAR_TRANSPORT = 4.0
WORKERS_PER_BUILDER = 30
ARMY_PER_DEFENDER = 15


@dataclass(frozen=True, slots=True)
class Team:
    """A team as agents name it, with the units that it has now."""

    agent: str
    name: str
    kind: TeamKind
    tags: tuple[int, ...]
    """Its units, the head first."""
    control_group: int | None
    config: TeamConfig

    @property
    def head(self) -> int:
        """Tag of the unit that the team's camera follows."""
        return self.tags[0]


class Roster:
    """Who has which unit in a running episode; one per side."""

    def __init__(self, agents: Iterable[AgentConfig]) -> None:
        self._agents = tuple(agents)
        self._groups = [[_Group(agent, team) for team in agent.teams] for agent in self._agents]
        self._places: dict[int, _Group] = {}

    def update(self, own: Sequence[raw_pb2.Unit], player: sc_pb.PlayerCommon) -> None:
        """Drops the units that are gone and gives new ones to their teams; `own` in ascending order of tags."""
        units = {unit.tag: unit for unit in own}
        for group in self._all_groups():
            group.tags = [tag for tag in group.tags if tag in units]
        grouped = {tag for group in self._all_groups() for tag in group.tags}
        for unit in own:
            if unit.tag not in grouped and unit.build_progress >= 1.0:
                self._place(unit, units, player)

    def teams(self, agent: str) -> tuple[Team, ...]:
        """The agent's teams that have units, in the order of its configuration."""
        return tuple(team for group in self._all_groups() if group.agent.name == agent for team in group.teams())

    def idle_teams(self, agent: str) -> tuple[str, ...]:
        """Names of the agent's teams that have no unit now."""
        return tuple(g.config.name for g in self._all_groups() if g.agent.name == agent and not g.tags)

    def _all_groups(self) -> Iterable[_Group]:
        return (group for groups in self._groups for group in groups)

    def _place(self, unit: raw_pb2.Unit, units: Mapping[int, raw_pb2.Unit], player: sc_pb.PlayerCommon) -> None:
        group = self._places.get(unit.tag) or self._find(unit, units, player)
        if group is not None:
            self._places[unit.tag] = group
            group.add(unit.tag)

    def _find(self, unit: raw_pb2.Unit, units: Mapping[int, raw_pb2.Unit], player: sc_pb.PlayerCommon) -> _Group | None:
        name = unit_name(unit.unit_type)
        by_agent = [[g for g in groups if name in g.config.unit_types] for groups in self._groups]
        for airborne in (True, False):
            for groups, candidates in zip(self._groups, by_agent, strict=True):
                if not candidates or (candidates[0].agent.admits == "airborne") != airborne:
                    continue
                if _admits(groups, name, unit, units, player):
                    return _choose(candidates, unit, units)
        return None


@dataclass(slots=True)
class _Group:
    """A configured team and its units in the order in which they came."""

    agent: AgentConfig
    config: TeamConfig
    tags: list[int] = field(default_factory=list)
    numbers: dict[int, int] = field(default_factory=dict)
    """Number of every unit that it ever had; a dead unit's number is not given again."""

    def add(self, tag: int) -> None:
        self.tags.append(tag)
        self.numbers.setdefault(tag, len(self.numbers) + 1)

    def teams(self) -> Iterable[Team]:
        name, kind, agent = self.config.name, self.config.kind, self.agent.name
        if not self.tags:
            return
        if kind != "select":
            yield Team(agent, name, kind, tuple(self.tags), self.config.control_group, self.config)
            return
        for tag in self.tags:
            yield Team(agent, f"{name}-{self.numbers[tag]}", kind, (tag,), None, self.config)


def _admits(
    groups: Sequence[_Group],
    name: str,
    unit: raw_pb2.Unit,
    units: Mapping[int, raw_pb2.Unit],
    player: sc_pb.PlayerCommon,
) -> bool:
    has = sum(len(group.tags) for group in groups)
    match groups[0].agent.admits:
        case "combat":
            return name not in WORKERS or has == 0
        case "builder":
            return has < player.food_workers / WORKERS_PER_BUILDER
        case "defender":
            return has < player.food_army / ARMY_PER_DEFENDER
        case "airborne":
            transports = [u for u in units.values() if unit_name(u.unit_type) in TRANSPORTS and u.tag != unit.tag]
            return name in TRANSPORTS or any(_distance(unit, t) < NEAR_TRANSPORT for t in transports)
        case "any":
            return True


def _choose(groups: Sequence[_Group], unit: raw_pb2.Unit, units: Mapping[int, raw_pb2.Unit]) -> _Group:
    if not any(group.tags for group in groups):
        return groups[0]
    smallest = min(groups, key=lambda group: len(group.tags))
    nearest = min((g for g in groups if g.tags), key=lambda group: _distance(unit, units[group.tags[0]]))
    if groups[0].config.kind == "group":
        return smallest if len(smallest.tags) < SMALL_GROUP else nearest
    if _distance(unit, units[nearest.tags[0]]) < NEAR_HEAD:
        return nearest
    return nearest if smallest.tags else smallest


def _distance(a: raw_pb2.Unit, b: raw_pb2.Unit) -> float:
    return math.hypot(a.pos.x - b.pos.x, a.pos.y - b.pos.y)
