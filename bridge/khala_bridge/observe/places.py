"""The named places of the map as a side knows them: whose town hall stands there, and when it last looked.

`khala_bridge.state.ground.atlas` gives the names, `khala_bridge.observe.chronicle` knows the enemies. A memory of one
episode, which takes in every snapshot; for agents that lead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_bridge.observe.body import to_tenth
from khala_bridge.state.ground import land_of
from khala_bridge.state.ground.atlas import BASE_TAKEN, HOME, atlas_of
from khala_bridge.state.ground.land import SEEN_NOW
from khala_protocol.messages import LOOPS_PER_S, Place

if TYPE_CHECKING:
    from khala_bridge.frames import MapFrame
    from khala_bridge.state import Snapshot, Unit
    from khala_bridge.state.ground import Land
    from khala_bridge.state.ground.atlas import Atlas, NamedPlace


@dataclass(slots=True)
class Places:
    """What a side knows of the places of the map in one episode."""

    atlas: Atlas | None = None
    """None until the side has a town hall, and on maps where it never has one."""
    _seen: dict[str, int] = field(default_factory=dict)
    """By name of a place, the game loop at which it was last in sight."""

    def note(self, snapshot: Snapshot) -> None:
        """Take in an observation."""
        land = land_of(snapshot)
        if self.atlas is None and land.own_halls:
            self.atlas = atlas_of(land.ground, land.bases, land.own_halls[0].pos)
        if self.atlas is None:
            return
        for place in self.atlas.places:
            if land.sight[int(place.at.x), int(place.at.y)] == SEEN_NOW:
                self._seen[place.name] = snapshot.game_loop

    def views(self, snapshot: Snapshot, world: MapFrame) -> tuple[Place, ...]:
        """Return the places, with what the side knows of each."""
        land = land_of(snapshot)
        return tuple(self._view(place, snapshot, land, world) for place in self.atlas.places) if self.atlas else ()

    def _view(self, place: NamedPlace, snapshot: Snapshot, land: Land, world: MapFrame) -> Place:
        hall = _hall_at(place, land) if place.what == "base" else None
        seen = self._seen.get(place.name)
        return Place(
            name=place.name,
            what=place.what,
            minimap=to_tenth(world.minimap(*place.at), world.minimap_size),
            start=place.start,
            holder="" if hall is None else "own" if hall.is_own else "enemy",
            unseen_s=None if seen is None else round((snapshot.game_loop - seen) / LOOPS_PER_S, 1),
            about=_about(place, hall, sole=len(land.ground.starts) == 1),
        )

    def name_of(self, point: tuple[float, float]) -> str:
        """Return the name of the place that a point is at; "" if it is at none."""
        found = self.atlas.nearest(point) if self.atlas else None
        return found.name if found else ""


def _hall_at(place: NamedPlace, land: Land) -> Unit | None:
    return next((hall for hall in land.halls if math.dist(hall.pos, place.at) <= BASE_TAKEN), None)


def _about(place: NamedPlace, hall: Unit | None, *, sole: bool) -> str:
    """Return what else is to be said of a place; `sole` if an enemy can have begun at one place only."""
    if hall is not None:
        return hall.name + (f", {100 * hall.build_progress:.0f}% built" if hall.build_progress < 1 else "")
    if place.start and place.name != HOME:
        return f"the enemy {'began' if sole else 'may have begun'} here"
    return f"{place.width} cells wide" if place.width else ""
