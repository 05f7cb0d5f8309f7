"""The targets of orders: tags and points of a call → units and world points, or what is wrong with them.

A team aims at units on its screen and at its own units anywhere. A rule of `khala_bridge.auto` takes anything that the
side knows, such as a mineral field in the fog. A rejection names near misses of a tag, but none is taken: the wrong
target may be the worst one. This module knows nothing of the acting units' abilities, except what their targets may be.

A call may be older than the present moment. Its points are those of the screen that its agent saw, and what stood there
is a valid target wherever it is now, as long as the side sees it. Answers are in the present frames, since the agent
reads them with its next observation.
"""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING

from khala_bridge.act.rejected import CallRejected
from khala_bridge.auto.aims import aim_of, needs_sight, unfit
from khala_bridge.frames import CAMERA_WIDTH, Camera, MinimapPoint, ScreenPoint, WorldPoint, central
from khala_bridge.state import Alliance
from khala_bridge.state.ground import land_of
from khala_bridge.state.ground.land import SEEN_NOW
from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.act.recognise import Recognised
    from khala_bridge.observe.observation import SideObservation
    from khala_bridge.state import Unit
    from khala_protocol.messages import RejectionReason

_SIDES = {Alliance.OWN: "own", Alliance.ALLY: "ally", Alliance.ENEMY: "enemy", Alliance.NEUTRAL: "neutral"}
_WHOSE = {
    Alliance.OWN: "your own",
    Alliance.ALLY: "your ally's",
    Alliance.ENEMY: "an enemy",
    Alliance.NEUTRAL: "nobody's",
}
MOST_SLIPS = 2
"""Wrong digits up to which a tag counts as a slip of another one."""
SHORTEST = 6
"""Characters by which a cut tag is still known: `0x1008`."""


class Targets:
    """The possible targets at the present moment."""

    def __init__(self, observation: SideObservation) -> None:
        self._observation = observation
        self._units = observation.snapshot.units
        self._facts = observation.snapshot.facts

    def end_of(self, tag: int) -> str | None:
        """Return the end of a unit in words, `died 1.8 s ago`; None if it is not known to be dead."""
        if tag not in self._observation.died:
            return None
        loops = self._observation.snapshot.game_loop - self._observation.died[tag]
        return f"died {loops / LOOPS_PER_S:.1f} s ago" if loops else "is dead"

    def end_of_all(self, tags: Iterable[int]) -> str:
        """Return the end of a team that is gone, in words."""
        died = self._observation.died
        last = max(tags, key=lambda tag: died.get(tag, math.inf))
        end = self.end_of(last)
        return f"its last unit {end}" if end else "its units are not on the map"

    def named_units(self, said: Recognised) -> tuple[int, ...]:
        """Return the units that the first arguments name.

        Raises:
            CallRejected: one of them is not a unit of the team, is gone, or is named twice.
        """
        tags = said.tags[: said.action.actor_count]
        for tag in tags:
            if tag not in said.team.tags:
                raise self._not_of_team(said, tag)
            if tag not in self._units:
                raise self._gone(tag)
        if twice := [tag for place, tag in enumerate(tags) if tag in tags[:place]]:
            what = f"{said.action.name} takes two different units, {hex(twice[0])} stands there twice."
            raise CallRejected("wrong_arguments", what)
        return tags

    def unit(self, said: Recognised) -> Unit:
        """Return the unit that the last tag names.

        Raises:
            CallRejected: the unit does not exist, is dead or out of sight, or does not fit the action.
        """
        tag = said.tags[-1]
        anywhere = said.action.rule is not None or said.team.camera is None
        unit = (self._observation.snapshot.known if anywhere else self._units).get(tag)
        if unit is None:
            raise self._nowhere(said, tag)
        own = tag in said.team.tags
        if not (anywhere or own or _shows(said.team.camera, unit) or said.team.seen(tag)):
            raise self._out_of_sight(said, unit)
        if said.action.aim == "unit" and (reason := unfit(self._facts, said.action, aim_of(unit))):
            what = f"{hex(tag)} is {_WHOSE[unit.alliance]} {unit.name}"
            is_friend = said.action.target == "enemy" and unit.alliance in (Alliance.OWN, Alliance.ALLY)
            kind: RejectionReason = "friendly_target" if is_friend else "invalid_target"
            raise CallRejected(kind, f"{what}; {said.action.name} needs {reason}.")
        return unit

    def place(self, said: Recognised) -> WorldPoint:
        """Return the point among the arguments, in the world.

        Raises:
            CallRejected: it is outside of its frame, beyond the edge of the map, or out of sight for an action that
                needs sight.
        """
        point = self._screen_point(said) if said.action.target_kind == "screen" else self._minimap_point(said)
        if needs_sight(self._facts, said.action) and not self._is_seen(point):
            where = f"[{said.point[0]:g}, {said.point[1]:g}]" if said.point else "The place"
            raise CallRejected(
                "invalid_target", f"{where} is out of your sight; {said.action.name} needs a place in sight."
            )
        return point

    def instead(self, place: WorldPoint) -> str:
        """Return a valid place as the end of a sentence, on the minimap: screens move on before this is read."""
        x, y = self._observation.map.minimap(place.x, place.y)
        return f"; the nearest free place is at [{round(x, 1):g}, {round(y, 1):g}] of the minimap"

    def _camera_now(self, said: Recognised) -> Camera | None:
        """Return the present camera of a call's team; None if the team has no screen, or no unit any more."""
        then = said.team.camera
        team = self._observation.team_now(said.team)
        if then is None or team is None:
            return None
        places = [self._units[tag].pos for tag in team.tags]
        return Camera(*places[central(places)], then.size)

    def _is_seen(self, point: WorldPoint) -> bool:
        """Return True if the player sees a place now."""
        cells = land_of(self._observation.snapshot).sight  # (w, h)
        x, y = min(int(point.x), cells.shape[0] - 1), min(int(point.y), cells.shape[1] - 1)
        return bool(cells[x, y] == SEEN_NOW)

    # --- points -----------------------------------------------------------------------------------------------

    def _screen_point(self, said: Recognised) -> WorldPoint:
        name, camera = said.team.name, said.team.camera
        if camera is None:
            raise CallRejected("wrong_frame", f"Team {name} has no units and no screen; give this to a team that has.")
        x, y = self._in_frame(said, "screen", camera.size, "minimap", self._observation.map.minimap_size)
        point = camera.world(ScreenPoint(x, y))
        if not self._observation.map.holds(point):
            raise CallRejected("out_of_bounds", f"[{x:g}, {y:g}] lies beyond the edge of the map; {self._playable()}.")
        return point

    def _minimap_point(self, said: Recognised) -> WorldPoint:
        screen = 0.0 if said.team.camera is None else said.team.camera.size
        x, y = self._in_frame(said, "minimap", self._observation.map.minimap_size, "screen", screen)
        point = self._observation.map.world(MinimapPoint(x, y))
        if not self._observation.map.holds(point):
            what = f"[{x:g}, {y:g}] of the minimap lies beyond the edge of the map"
            is_on_screen = x <= screen and y <= screen
            kind: RejectionReason = "wrong_frame" if is_on_screen else "out_of_bounds"
            hint = self._sister(said, "minimap", "screen") if is_on_screen else self._playable()
            raise CallRejected(kind, f"{what}; {hint}.")
        return point

    def _playable(self) -> str:
        x0, y0, x1, y1 = (f"{round(value, 1):g}" for value in self._observation.map.bounds)
        return f"on the minimap it is x {x0} to {x1}, y {y0} to {y1}"

    def _in_frame(self, said: Recognised, frame: str, size: float, other: str, its_size: float) -> tuple[float, float]:
        assert said.point is not None  # recognised by its form
        x, y = said.point
        if 0 <= x <= size and 0 <= y <= size:
            return x, y
        if not (0 <= x <= its_size and 0 <= y <= its_size):
            raise CallRejected(
                "out_of_bounds", f"[{x:g}, {y:g}] is outside of the {frame}: x and y are from 0 to {size:g}."
            )
        where = f"[{x:g}, {y:g}] is outside of the {frame}, where x and y are from 0 to {size:g}"
        raise CallRejected("wrong_frame", f"{where}; {self._sister(said, frame, other)}.")

    def _sister(self, said: Recognised, frame: str, other: str) -> str:
        """Return as the end of a sentence which action takes a point of the other frame."""
        sister = said.action.name.replace(frame.capitalize(), other.capitalize())
        agent = self._observation.configs[said.team.agent]
        has_sister = sister in {action.name for action in agent.catalogue()}
        hint = f"for one of the {other} there is {sister}" if has_sister else f"it looks like one of the {other}"
        return f"{said.action.name} takes a point of the {frame}, {hint}"

    # --- tags that are wrong ----------------------------------------------------------------------------------

    def _nowhere(self, said: Recognised, tag: int) -> CallRejected:
        if end := self.end_of(tag):
            return CallRejected("dead_target", f"The unit {hex(tag)} {end}; choose another target.")
        if was := said.team.seen(tag):
            what = f"The {was.alliance} {was.type} {was.tag} is out of sight now"
            where = f"it was at [{was.minimap[0]:.0f}, {was.minimap[1]:.0f}] of the minimap when you saw it"
            return CallRejected("unknown_target", f"{what}; {where}.")
        wanted = said.action.target
        camera = self._camera_now(said)
        fits = [unit.tag for unit in self._units.values() if _may_be_meant(camera, unit, wanted)]
        hint = self._near_miss(tag, fits) or "use a tag that stands in its lists."
        return CallRejected("unknown_target", f"No unit {hex(tag)} is in sight of team {said.team.name}; {hint}")

    def _not_of_team(self, said: Recognised, tag: int) -> CallRejected:
        name = said.team.name
        own = [tag for tag in said.team.tags if tag in self._units]
        if self.end_of(tag):
            return self._gone(tag)
        units = f"units of team {name} are {', '.join(map(hex, own))}"
        unit = self._units.get(tag)
        if unit is None:
            hint = self._near_miss(tag, own) or f"{units}."
            return CallRejected("unknown_target", f"There is no unit {hex(tag)}; {hint}")
        what = f"{hex(tag)} is {_WHOSE[unit.alliance]} {unit.name}"
        if said.action.actor_count == 1 and said.tags[-1] in own and len(said.tags) > 1:
            right = f"{said.action.name}({hex(said.tags[-1])}, {hex(tag)})"
            return CallRejected("not_yours", f"{what}, the unit that acts comes first: did you mean <{right}>?")
        owner = self._observation.team_of(tag)
        whose = f" of team {owner}" if owner else ""
        return CallRejected("not_yours", f"{what}{whose} and not one of team {name}; {units}.")

    def _gone(self, tag: int) -> CallRejected:
        if end := self.end_of(tag):
            return CallRejected("dead_target", f"The unit {hex(tag)} {end}; it does nothing any more.")
        return CallRejected(
            "not_available", f"The unit {hex(tag)} is not on the map now; it may be inside another one."
        )

    def _near_miss(self, tag: int, tags: Iterable[int]) -> str | None:
        """Return the tag that was most likely meant, as the end of a sentence; None if no tag is similar."""
        wanted = hex(tag)
        slips = ((_slips(wanted, hex(known)), known) for known in tags)
        _slip, meant = min(((slip, known) for slip, known in slips if slip is not None), default=(0, None))
        if meant is None:
            return None
        return f"did you mean {hex(meant)} ({self._units[meant].name})?"

    def _out_of_sight(self, said: Recognised, unit: Unit) -> CallRejected:
        x, y = self._observation.map.minimap(unit.pos.x, unit.pos.y)
        what = f"{_SIDES[unit.alliance]} {unit.name} {hex(unit.tag)}"
        away = f"is out of sight of team {said.team.name}, at [{x:.0f}, {y:.0f}] of the minimap"
        return CallRejected("unknown_target", f"The {what} {away}; move there first.")


def _slips(wanted: str, known: str) -> int | None:
    """Return the number of slips between a written tag and an existing one, if they are few: 0 for a tag that was cut.

    One digit too many or too few is one slip, up to two may be wrong. Two tags of units differ in two or three.
    """
    if known.startswith(wanted) and len(wanted) >= SHORTEST:
        return 0
    if len(wanted) == len(known):
        wrong = sum(map(operator.ne, wanted, known))
        return wrong if wrong <= MOST_SLIPS else None
    shorter, longer = sorted((wanted, known), key=len)
    dropped = (longer[:place] + longer[place + 1 :] for place in range(2, len(longer)))
    return 1 if len(longer) == len(shorter) + 1 and shorter in dropped else None


def _may_be_meant(camera: Camera | None, unit: Unit, wanted: str | None) -> bool:
    if camera is not None and not _shows(camera, unit):
        return False
    return wanted is None or unit.is_enemy == (wanted == "enemy")


def _shows(camera: Camera | None, unit: Unit) -> bool:
    """Return True if a camera's screen shows a unit."""
    if camera is None:
        return False
    right, down, half = unit.pos.x - camera.x, camera.y - unit.pos.y, CAMERA_WIDTH / 2
    return -half <= right < half and -half <= down < half
