"""Recognised actions → commands to the game, checked against what the agent saw.

A command knows units, an ability, a unit or a point of the world as its target, and whether it waits behind earlier
orders. It knows no frame and no PySC2 function call: the two executors play the same commands.

Order of the commands of one reply, unit by unit: the first one replaces what the unit did, a later one waits for it
if the action queues (the catalogue says), and replaces it if not. In the paper it is the first queueing function of a
*team* that replaces, which makes an order to a second unit wait behind that unit's old order, and lets an attack
cancel a skill of the same reply, since here all commands of a reply reach the game in one loop.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from s2clientprotocol import raw_pb2

from bridge.act.recognise import Recognised, Refused, reject
from bridge.frames import MinimapPoint, ScreenPoint, WorldPoint
from bridge.names import unit_name
from bridge.observe.sight import Sight, unmet

if TYPE_CHECKING:
    from bridge.action import Action
    from bridge.functions import Function
    from protocol.messages import Rejection

_SIDES = {raw_pb2.Self: "own", raw_pb2.Ally: "ally", raw_pb2.Enemy: "enemy", raw_pb2.Neutral: "neutral"}


@dataclass(frozen=True, slots=True)
class Command:
    """One order to some units of a team."""

    said: Recognised
    """The action that it carries out."""
    function: Function
    """PySC2's function for it, which names the ability."""
    units: tuple[int, ...]
    target: int | WorldPoint | None
    """Tag of a unit, or a point of the world."""
    queued: bool = False

    @property
    def action(self) -> Action:
        """Its entry in the catalogue."""
        return self.said.action


class Translator:
    """Translates the calls of one agent's reply, one after the other."""

    def __init__(self, sight: Sight, max_actions: int) -> None:
        self._sight = sight
        self._max_actions = max_actions
        self._ordered: set[int] = set()
        self._count: dict[str, int] = {}

    def translate(self, said: Recognised) -> list[Command] | Rejection:
        """Commands for a call: none for an action that orders nothing, two if only some of its units have to wait."""
        try:
            units, target = self._units(said), self._target(said)
            self._count_in(said)
        except Refused as refused:
            return reject(said.call, refused, said.team.view.name)
        function = said.action.pysc2
        if function is None:
            return []
        first = tuple(tag for tag in units if not (said.action.queue and tag in self._ordered))
        later = tuple(tag for tag in units if said.action.queue and tag in self._ordered)
        self._ordered.update(units)
        commands = (Command(said, function, first, target), Command(said, function, later, target, queued=True))
        return [command for command in commands if command.units]

    def _count_in(self, said: Recognised) -> None:
        name = said.team.view.name
        if self._count.get(name, 0) >= self._max_actions:
            limit = f"{self._max_actions} action{'s' if self._max_actions > 1 else ''}"
            raise Refused("too_many_actions", f"Team {name} had its {limit} in this reply already.")
        self._count[name] = self._count.get(name, 0) + 1

    # --- who --------------------------------------------------------------------------------------------------

    def _units(self, said: Recognised) -> tuple[int, ...]:
        action, team = said.action, said.team
        tags = team.team.tags
        if action.subject == "unit":
            if said.tags[0] not in tags:
                known = ", ".join(unit.tag for unit in team.view.units)
                raise Refused(
                    "invalid_target",
                    f"{hex(said.tags[0])} is no unit of team {team.view.name}; its units are {known}.",
                )
            tags = said.tags[:1]
        able = tuple(tag for tag in tags if tag in self._sight.snapshot.units and self._reason(said, tag) is None)
        if not able:
            reason = self._reason(said, tags[0]) if tags[0] in self._sight.snapshot.units else "it is gone"
            raise Refused("not_available", f"Team {team.view.name} cannot do {action.name} now: {reason}.")
        return able

    def _reason(self, said: Recognised, tag: int) -> str | None:
        """Why a unit cannot do it; None if it can."""
        agent = self._sight.agents[said.team.team.agent]
        unit_type = unit_name(self._sight.snapshot.units[tag].unit_type)
        if said.action.name not in agent.agent.actions.get(unit_type, ()):
            return f"{unit_type} has no such action"
        return unmet(said.action, unit_type, agent.view.upgrades)

    # --- at what ----------------------------------------------------------------------------------------------

    def _target(self, said: Recognised) -> int | WorldPoint | None:
        match said.action.target_kind:
            case None:
                return None
            case "tag":
                return self._target_unit(said, said.tags[-1])
            case "screen":
                return self._screen_point(said)
            case "minimap":
                return self._minimap_point(said)

    def _target_unit(self, said: Recognised, tag: int) -> int:
        view, tag_text = said.team.view, hex(tag)
        in_sight = (*view.units, *view.allies, *view.enemies)
        unit = next((unit for unit in in_sight if unit.tag == tag_text), None)
        if unit is None:
            raise Refused("unknown_target", self._where_it_is(said, tag))
        wanted = said.action.target
        if (wanted == "enemy" and unit.alliance != "enemy") or (wanted == "own" and unit.alliance == "enemy"):
            whose = {"own": "your own", "ally": "your own", "enemy": "an enemy", "neutral": "nobody's"}[unit.alliance]
            of = "an enemy unit" if wanted == "enemy" else "an own unit"
            raise Refused("invalid_target", f"{tag_text} is {whose} {unit.type}; {said.action.name} needs {of}.")
        return tag

    def _where_it_is(self, said: Recognised, tag: int) -> str:
        name = said.team.view.name
        if tag in self._sight.snapshot.dead:
            return f"The unit {hex(tag)} is dead; choose another target."
        unit = self._sight.snapshot.units.get(tag)
        if unit is None:
            return f"No unit {hex(tag)} is in sight of team {name}; use a tag that stands in its lists."
        x, y = self._sight.map.minimap(unit.pos.x, unit.pos.y)
        what = f"{_SIDES[unit.alliance]} {unit_name(unit.unit_type)} {hex(tag)}"
        return f"The {what} is out of sight of team {name}, at [{x:.0f}, {y:.0f}] of the minimap; move there first."

    def _screen_point(self, said: Recognised) -> WorldPoint:
        x, y = self._in_frame(said, "screen", said.team.camera.size)
        point = said.team.camera.world(ScreenPoint(x, y))
        if not self._sight.map.holds(point):
            x0, y0, x1, y1 = (f"{value:g}" for value in said.team.view.bounds)
            inside = f"for team {said.team.view.name} x is from {x0} to {x1} and y from {y0} to {y1}"
            raise Refused("out_of_bounds", f"[{x:g}, {y:g}] lies beyond the edge of the map; {inside}.")
        return point

    def _minimap_point(self, said: Recognised) -> WorldPoint:
        x, y = self._in_frame(said, "minimap", self._sight.map.minimap_size)
        point = self._sight.map.world(MinimapPoint(x, y))
        if not self._sight.map.holds(point):
            raise Refused("out_of_bounds", f"[{x:g}, {y:g}] of the minimap lies beyond the edge of the playable map.")
        return point

    @staticmethod
    def _in_frame(said: Recognised, frame: str, size: float) -> tuple[float, float]:
        assert said.point is not None  # recognised by its form
        x, y = said.point
        if not (0 <= x <= size and 0 <= y <= size):
            raise Refused("out_of_bounds", f"[{x:g}, {y:g}] is outside of the {frame}: x and y are from 0 to {size:g}.")
        return x, y
