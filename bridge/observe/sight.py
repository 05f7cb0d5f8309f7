"""The typed view of every team from a snapshot.

A team sees what its camera shows: a square of 24 world units around its head unit. The camera is virtual, it needs
no move in the game and does not stop at the border of the map. The team's own units are listed wherever they are,
with a position outside of the frame if the camera does not reach them; everything else only within it. Neutral units
(resources, rocks) and larvae are left out.

Here are views only; words are made in `bridge.observe.text`. A `Sight` also carries what the host needs to carry out
what is answered to it: cameras, tags and the snapshot. No world coordinate is in a view.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from s2clientprotocol import raw_pb2

from bridge.catalog import catalogue
from bridge.frames import Camera, MapFrame, WorldPoint
from bridge.knowledge import is_armed
from bridge.names import buff_name, order_name, unit_name, upgrade_name
from bridge.observe.events import events
from protocol.messages import LOOPS_PER_S, Resources, TeamView, UnitView, View

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bridge.action import Action
    from bridge.observe.teams import Roster, Team
    from bridge.snapshot import Snapshot
    from bridge.task import AgentConfig
    from protocol.messages import ActionSpec, Alliance, Frames, Point

UNSEEN_TYPES = frozenset({"Larva", "Cocoon"})
_FRIENDS = (raw_pb2.Self, raw_pb2.Ally)
_CLOAKED = (raw_pb2.Cloaked, raw_pb2.CloakedDetected, raw_pb2.CloakedAllied)


@dataclass(frozen=True, slots=True)
class TeamSight:
    """A team, its camera and its view."""

    team: Team
    camera: Camera
    view: TeamView


@dataclass(frozen=True, slots=True)
class AgentSight:
    """What one agent sees; `text` is empty until it is written."""

    agent: AgentConfig
    view: View
    teams: tuple[TeamSight, ...]
    idle_teams: tuple[str, ...]
    """Teams that have no unit now."""
    text: str = ""


@dataclass(frozen=True, slots=True)
class Sight:
    """What a side sees at one moment: the snapshot and what its agents make of it."""

    snapshot: Snapshot
    map: MapFrame
    agents: dict[str, AgentSight]


@dataclass(frozen=True, slots=True)
class _Body:
    """A unit as every team sees it: all of its view that does not depend on who looks."""

    tag: int
    x: float
    y: float
    name: str
    alliance: int
    view: UnitView


class Scene:
    """One snapshot while views are made of it; what all teams see alike is made once."""

    def __init__(self, snapshot: Snapshot, frames: Frames) -> None:
        """Takes a snapshot and the frames that its views are given in."""
        self._snapshot = snapshot
        self._world = MapFrame.of(snapshot.info, frames)
        self._screen_size = frames.screen
        self._bodies = {tag: self._body(unit) for tag, unit in snapshot.units.items()}
        self._order = tuple(self._bodies.values())
        self._places = np.array([(body.x, body.y) for body in self._order]).reshape(-1, 2)  # (units, 2), world
        self._dead = {hex(tag) for tag in snapshot.dead}
        observation = snapshot.response.observation
        self._common = observation.player_common
        self._upgrades = tuple(upgrade_name(number) for number in sorted(observation.raw_data.player.upgrade_ids))

    def sight(self, agents: dict[str, AgentSight]) -> Sight:
        """The sight of the side, when all its agents have been looked for."""
        return Sight(self._snapshot, self._world, agents)

    def agent(self, agent: AgentConfig, roster: Roster, before: AgentSight | None) -> AgentSight:
        """What one agent sees.

        Args:
            agent: whose teams they are.
            roster: who has which unit; it has been updated with the snapshot.
            before: what the agent saw before, for events; None at the beginning of an episode.
        """
        earlier = {} if before is None else {team.view.name: team.view for team in before.teams}
        teams = tuple(self._team(agent, team, earlier.get(team.name)) for team in roster.teams(agent.name))
        return AgentSight(agent, self._view(teams), teams, roster.idle_teams(agent.name))

    def _view(self, teams: Iterable[TeamSight]) -> View:
        common = self._common
        return View(
            time_s=round(self._snapshot.game_loop / LOOPS_PER_S, 3),
            resources=Resources(
                minerals=common.minerals,
                vespene=common.vespene,
                supply_used=common.food_used,
                supply_cap=common.food_cap,
            ),
            upgrades=self._upgrades,
            teams=tuple(team.view for team in teams),
        )

    def _team(self, agent: AgentConfig, team: Team, before: TeamView | None) -> TeamSight:
        members = [self._bodies[tag] for tag in team.tags]
        camera = Camera(members[0].x, members[0].y, self._screen_size)
        mean = WorldPoint(_mean([body.x for body in members]), _mean([body.y for body in members]))
        others = [body for body in self._seen_by(camera) if body.tag not in team.tags]
        friends = [body for body in others if body.alliance in _FRIENDS]
        foes = [body for body in others if body.alliance == raw_pb2.Enemy and body.name not in UNSEEN_TYPES]
        enemies = [self._unit(body, camera, "enemy", mean) for body in foes]
        allies = [self._unit(body, camera, "ally") for body in friends]
        view = TeamView(
            name=team.name,
            minimap=_rounded(self._world.minimap(camera.x, camera.y), self._world.minimap_size),
            units=tuple(self._unit(body, camera, "own") for body in members),
            allies=tuple(sorted(allies, key=lambda unit: unit.type)),
            enemies=tuple(sorted(enemies, key=lambda unit: (unit.type, unit.distance))),
            actions=self._actions(agent, [body.name for body in members]),
            bounds=_edges(camera.bounds(self._world)),
        )
        return TeamSight(team, camera, view.but(events=events(before, view, self._dead)))

    def _seen_by(self, camera: Camera) -> list[_Body]:
        """The units on a camera's screen, in the order of their tags."""
        return [self._order[index] for index in np.flatnonzero(camera.sees(self._places)).tolist()]

    def _actions(self, agent: AgentConfig, types: list[str]) -> tuple[ActionSpec, ...]:
        valid: dict[str, Action] = {}
        for unit_type in dict.fromkeys(types):
            for name in agent.actions.get(unit_type, ()):
                if unmet(catalogue()[name], unit_type, self._upgrades) is None:
                    valid.setdefault(name, catalogue()[name])
        return tuple(action.spec for action in valid.values())

    def _unit(self, body: _Body, camera: Camera, alliance: Alliance, mean: WorldPoint | None = None) -> UnitView:
        screen = _rounded(camera.screen(body.x, body.y), self._screen_size)
        distance = None if mean is None else round(math.hypot(body.x - mean.x, body.y - mean.y), 1)
        return body.view.but(alliance=alliance, screen=screen, distance=distance)

    def _body(self, unit: raw_pb2.Unit) -> _Body:
        x, y, name = unit.pos.x, unit.pos.y, unit_name(unit.unit_type)
        mine = unit.alliance == raw_pb2.Self
        view = UnitView(
            tag=hex(unit.tag),
            type=name,
            alliance="neutral",
            screen=(0.0, 0.0),
            minimap=_rounded(self._world.minimap(x, y), self._world.minimap_size),
            health=round(unit.health, 1),
            health_max=unit.health_max,
            shield=round(unit.shield, 1),
            shield_max=unit.shield_max,
            energy=round(unit.energy, 1),
            energy_max=unit.energy_max,
            weapon_cooldown_s=round(unit.weapon_cooldown / LOOPS_PER_S, 2) if mine and is_armed(name) else None,
            build_progress=round(unit.build_progress, 2),
            flying=unit.is_flying,
            cloaked=unit.cloak in _CLOAKED,
            hallucination=unit.is_hallucination,
            buffs=tuple(buff_name(buff) for buff in unit.buff_ids),
            order=order_name(unit.orders[0].ability_id) if mine and unit.orders else None,
        )
        return _Body(unit.tag, x, y, name, unit.alliance, view)


def unmet(action: Action, unit_type: str, upgrades: Iterable[str]) -> str | None:
    """Why units of a type cannot do an action now, as the end of a sentence; None if they can."""
    if action.needs.weapon and not is_armed(unit_type):
        return f"{unit_type} has no weapon"
    if action.needs.upgrade is not None and action.needs.upgrade not in upgrades:
        return f"{action.needs.upgrade} is not researched"
    return None


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def _rounded(point: tuple[float, float], size: float) -> Point:
    """To a tenth of a cell; a position within a frame stays within it, whose end is open."""
    return _tenth(point[0], size), _tenth(point[1], size)


def _tenth(value: float, size: float) -> float:
    near = round(value, 1) + 0.0  # no negative zero
    return round(size - 0.1, 1) if value < size <= near else near


def _edges(bounds: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = bounds
    return round(x0, 1), round(y0, 1), round(x1, 1), round(y1, 1)
