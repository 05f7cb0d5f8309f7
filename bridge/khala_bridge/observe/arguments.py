"""Which arguments of a valid action will do: tags of units, units that can carry it out, and places.

An action is offered if some unit can do it. Here stand the arguments with which it is accepted, where not everything
that the text shows would be: three of five enemies in reach of a weapon, free ground for a structure, the structures
that can be boosted. If nothing would do, the action is no offer. The answers come from the checks that refuse calls:
`khala_bridge.auto.aims` for targets, `khala_bridge.auto.openings` for rules and places.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.auto.aims import needs_sight, reaches, unfit
from khala_bridge.auto.openings import openings, seen_points, tags_for, tumor_places
from khala_bridge.auto.spread import TUMORS
from khala_bridge.rules import asked_by, is_attack, why_not
from khala_bridge.state.side import place
from khala_protocol.messages import ValidArguments

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from khala_bridge.auto.aims import Aim
    from khala_bridge.catalogue.action import Action
    from khala_bridge.frames import Camera, MapFrame, WorldPoint
    from khala_bridge.rules import Ledger, SideState, UnitState
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import AgentConfig
    from khala_protocol.messages import Point

MOST_POINTS = 5
"""Places that are listed for an action at most; the nearest ones."""
TUMOR = "Build_CreepTumor_screen"
"""The function of units that plant a tumor themselves, at a place that no rule chooses."""


class Lack(NamedTuple):
    """Nothing would do; the reason in short."""

    why: str


@dataclass(frozen=True, slots=True)
class Around:
    """What a team can aim at: the units on its screen by what matters of them as targets, and its own units."""

    world: MapFrame
    camera: Camera | None = None
    enemies: Mapping[Aim, Sequence[int]] = field(default_factory=dict)
    friends: Mapping[Aim, Sequence[int]] = field(default_factory=dict)
    """Units that are no enemies, those of the team among them."""


class Asker(NamedTuple):
    """Who asks for valid arguments: an agent's team, or the whole side, at one moment."""

    snapshot: Snapshot
    side: SideState
    ledger: Ledger
    around: Around
    agent: AgentConfig | None = None
    members: Sequence[UnitState] = ()
    """The units of the team; () for the whole side."""

    def arguments(self, action: Action) -> ValidArguments | Lack | None:
        """Return the arguments of a valid action that will do; None if all do that its kind suggests.

        An action at enemies suggests every enemy on the team's screen, another one every other unit; a unit that acts
        is any of the team, and a place any on the map.
        """
        if not action.args:
            return self._lack_of_team(action)
        doers = self._doers(action) if self.members else []
        units: list[int] | None = None
        if action.actor_count:
            if len(doers) < action.actor_count:
                return Lack("needs two units that can")
            units = None if len(doers) == len(self.members) else [unit.tag for unit in doers]
        match action.target_kind:
            case "tag":
                tags = self._tags(action, doers)
                return tags if isinstance(tags, Lack) else _written(action, units, tags)
            case "screen":
                points = self._points(action, doers)
                if isinstance(points, Lack):
                    return points
                return _written(action, units, None, points and [self._on_screen(point) for point in points])
            case _:
                return _written(action, units)

    def _lack_of_team(self, action: Action) -> Lack | None:
        """Return what a team's rule does not find; a side's was asked before."""
        if action.rule != "stop_building" or not self.members:
            return None
        return None if tags_for(action, self.snapshot, self.ledger) else Lack("nothing to call off")

    def _doers(self, action: Action) -> list[UnitState]:
        """Return the units of the team that can carry an action out; units in equal states are judged once."""
        assert self.agent is not None, "a team with units is an agent's"
        use = asked_by(action, of_side=False)
        having = [unit for unit in self.members if action.name in self.agent.actions.get(unit.type, ())]
        if use is None:
            return having
        judged: dict[tuple[object, ...], bool] = {}
        for unit in having:
            if unit[1:] not in judged:
                judged[unit[1:]] = why_not(use, unit, self.side, self.ledger) is None
        return [unit for unit in having if judged[unit[1:]]]

    # --- tags -------------------------------------------------------------------------------------------------

    def _tags(self, action: Action, doers: Sequence[UnitState]) -> list[int] | Lack | None:
        """Return the targets that will do; None if all do that the action's kind suggests."""
        if action.rule is not None:
            found = tags_for(action, self.snapshot, self.ledger)
            return found or Lack(_NOTHING.get(action.rule, "nothing to aim at"))
        if self.around.camera is None:
            return None
        hostile = action.target == "enemy"
        shown = self.around.enemies if hostile else self.around.friends
        fit = {aim: tags for aim, tags in shown.items() if self._fits(action, aim, doers)}
        tags = [tag for tags in fit.values() for tag in tags]
        if len(doers) == 1 and not action.actor_count:
            tags = [tag for tag in tags if tag != doers[0].tag]
        if not tags:
            return Lack("no enemy on the screen" + (" that fits" if shown else "") if hostile else "no unit that fits")
        return None if len(tags) == sum(map(len, shown.values())) else sorted(tags, key=self._away)

    def _away(self, tag: int) -> tuple[float, int]:
        """Return how far a unit is from the middle of the screen, squared, and its tag."""
        camera, at = self.around.camera, self.snapshot.units[tag].pos
        return (((at.x - camera.x) ** 2 + (at.y - camera.y) ** 2) if camera else 0.0, tag)

    def _fits(self, action: Action, aim: Aim, doers: Sequence[UnitState]) -> bool:
        function = action.pysc2
        if action.aim == "place" or function is None:
            return action.target != "enemy" or unfit(self.side.facts, action, aim) is None
        if unfit(self.side.facts, action, aim) is not None:
            return False
        if not is_attack(function):
            return True
        able = [reaches(self.side.facts, name, aim) for name in dict.fromkeys(unit.type for unit in doers)]
        return all(able) if action.actor_count else any(able)

    # --- places -----------------------------------------------------------------------------------------------

    def _points(self, action: Action, doers: Sequence[UnitState]) -> list[WorldPoint] | Lack | None:
        """Return some places on the screen that will do; None if every place on the map does."""
        camera = self.around.camera
        if camera is None:
            return None
        if action.rule == "build_at":
            found = openings(action, self.snapshot, camera, self.around.world, MOST_POINTS)
            return found or Lack("no place on the screen")
        if action.function == TUMOR:
            tumors = [place(self.snapshot.units[unit.tag]) for unit in doers if unit.type in TUMORS]
            spots = tumor_places(tumors, self.snapshot, camera, self.around.world, MOST_POINTS)
            return spots or Lack("no free creep on the screen within reach")
        if action.rule is None and needs_sight(self.side.facts, action):
            seen = seen_points(self.snapshot, camera, self.around.world, MOST_POINTS)
            return Lack("nothing in sight on the screen") if seen == [] else seen
        return None

    def _on_screen(self, point: WorldPoint) -> Point:
        """Return a place as a point of the team's screen, to a tenth of a cell."""
        assert self.around.camera is not None
        x, y = self.around.camera.screen(*point)
        return round(x, 1) + 0.0, round(y, 1) + 0.0


_NOTHING = {
    "stop_building": "nothing to call off",
    "cancel_building": "nothing is being built",
    "warp_near": "no power field with room",
    "build_near": "no free place",
    "lock_base": "no free base place",
}
"""By rule, what is lacking if no tag will do."""


def _written(
    action: Action,
    units: Iterable[int] | None,
    tags: Sequence[int] | None = None,
    points: Sequence[Point] | None = None,
) -> ValidArguments | None:
    if units is None and tags is None and points is None:
        return None
    return ValidArguments(
        action=action.name,
        units=tuple(map(hex, units or ())),
        tags=tuple(map(hex, tags or ())),
        points=tuple(points or ()),
    )
