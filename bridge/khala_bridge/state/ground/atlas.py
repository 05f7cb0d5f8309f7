"""The places of a map by name, as one player speaks of them: bases, ramps and passages.

Names are numbers by the way from the player's own start: Base 1 is where it begins, Base 2 the nearest other place for
a town hall, Ramp 1 the ramp nearest to home. So they stay the same for an episode, and mean the same to all agents of a
side. `khala_bridge.observe.places` says what is there now.
"""

from __future__ import annotations

import functools
import heapq
import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground.terrain import grown

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from khala_bridge.state.ground.resources import Base
    from khala_bridge.state.ground.terrain import Bools, Floats, MapGround

Feature = Literal["base", "ramp", "passage"]

MIN_RAMP = 8
"""Cells of the smallest ramp: one for small units is four cells wide and two long."""
MIN_RISE = 1.0
"""World units between the ends of a ramp; less is uneven ground."""
NARROW = 5
"""Cells from the middle of a passage to its walls, at most; wider ones are open ground."""
DETOUR = 20.0
"""Cells that a way is longer for a cell beside a wall; enough to keep it to the middle of passages."""
APART = 10.0
"""World units between a passage and the next place with a name; it goes without saying nearer to that."""
BASE_TAKEN = 6.0
"""World units from the middle of a base's place within which a town hall takes it."""
NEAR = 14.0
"""World units within which a unit is at a place: a base with its resources and structures."""


HOME = "Base 1"


class NamedPlace(NamedTuple):
    """A place that has a name."""

    name: str
    what: Feature
    at: WorldPoint
    start: bool = False
    """Whether a player may begin there."""
    width: int = 0
    """Of a passage, in cells."""


@dataclass(frozen=True, eq=False)
class Atlas:
    """The named places of a map for a player, those of each kind in the order of their ways from home."""

    ground: MapGround
    home: WorldPoint
    places: tuple[NamedPlace, ...]

    @property
    def bases(self) -> tuple[NamedPlace, ...]:
        """The places for a town hall; the first one is home."""
        return tuple(place for place in self.places if place.what == "base")

    def nearest(self, point: tuple[float, float]) -> NamedPlace | None:
        """Return the place that a point is at; None if it is at no place with a name."""
        found = min(self.places, key=lambda place: (math.dist(place.at, point), place.name), default=None)
        return found if found is not None and math.dist(found.at, point) <= NEAR else None


@functools.lru_cache(maxsize=8)
def atlas_of(ground: MapGround, bases: tuple[Base, ...], home: WorldPoint) -> Atlas:
    """Return the atlas of a map for the player who begins at `home`."""
    ways = ground.ways_from(home)
    others = (base.place for base in bases if math.dist(base.place, home) > BASE_TAKEN)
    in_order = [home, *sorted(others, key=lambda at: (_way(ways, at), at))]
    named = [
        NamedPlace(f"Base {number}", "base", at, start=_is_start(at, home, ground.starts))
        for number, at in enumerate(in_order, start=1)
    ]
    named += _number("Ramp", "ramp", _ramps(ground), ways)
    for goal in ground.starts:
        found = [
            (middle, width)
            for middle, width in _passages(ground, home, goal)
            if all(math.dist(middle, place.at) > APART for place in named)
        ]
        named += _number("Passage", "passage", found, ways, after=sum(place.what == "passage" for place in named))
    return Atlas(ground, home, tuple(named))


def _is_start(at: WorldPoint, home: WorldPoint, starts: Sequence[WorldPoint]) -> bool:
    return any(math.dist(at, start) < 1 for start in (home, *starts))


def _number(
    name: str, what: Feature, found: Sequence[tuple[WorldPoint, int]], ways: Floats, after: int = 0
) -> Iterator[NamedPlace]:
    in_order = sorted(found, key=lambda opening: (_way(ways, opening[0]), opening))
    for number, (at, width) in enumerate(in_order, start=1 + after):
        yield NamedPlace(f"{name} {number}", what, at, width=width)


def _way(ways: Floats, to: WorldPoint) -> float:
    return float(ways[int(to.x), int(to.y)])


# --- ramps ----------------------------------------------------------------------------------------------------


def _ramps(ground: MapGround) -> list[tuple[WorldPoint, int]]:
    """Return the middles of the ramps: patches of ground that is walked on, not built on, and rises."""
    left = ground.walkable & ~ground.buildable
    found = []
    while left.any():
        patch = _patch(left)
        left &= ~patch
        levels = ground.height[patch]
        if patch.sum() >= MIN_RAMP and np.ptp(levels) >= MIN_RISE:
            x, y = np.nonzero(patch)
            found.append((WorldPoint(round(float(x.mean()) + 0.5, 1), round(float(y.mean()) + 0.5, 1)), 0))
    return found


def _patch(cells: Bools) -> Bools:
    """Return the cells that are connected to the first cell."""
    patch = np.zeros_like(cells)
    patch[np.unravel_index(int(cells.argmax()), cells.shape)] = True
    while True:
        more = grown(patch, diagonal=True) & cells
        if (more == patch).all():
            return patch
        patch = more


# --- passages -------------------------------------------------------------------------------------------------


def _passages(ground: MapGround, home: WorldPoint, goal: WorldPoint) -> list[tuple[WorldPoint, int]]:
    """Return the narrowest points of the widest way from home to a goal, with their widths in cells."""
    room = _room(ground.walkable)
    cells = _widest_way(room, home, goal)
    narrow = [int(room[cell]) for cell in cells]
    found = []
    for run in _runs(narrow):
        middle = min(run, key=lambda place: (narrow[place], abs(place - (run[0] + run[-1]) / 2)))
        x, y = cells[middle]
        found.append((WorldPoint(x + 0.5, y + 0.5), 2 * narrow[middle] - 1))
    return found


def _room(walkable: Bools) -> Floats:
    """Return the distance (w, h) of each cell to the nearest wall, in steps that alternate as those of ways do."""
    wall = np.pad(~walkable, 1, constant_values=True)
    room = np.zeros(wall.shape, np.float32)
    for step in itertools.count(1):
        room[~wall] = step
        if wall.all():
            return room[1:-1, 1:-1]
        wall = grown(wall, diagonal=step % 2 == 0)
    raise AssertionError


def _widest_way(room: Floats, start: WorldPoint, goal: WorldPoint) -> list[tuple[int, int]]:
    """Return the cells of a short way that keeps away from walls; none if there is no way."""
    first, last = (int(start.x), int(start.y)), (int(goal.x), int(goal.y))
    open_ = [(0.0, first)]
    before: dict[tuple[int, int], tuple[int, int] | None] = {first: None}
    cost = {first: 0.0}
    while open_:
        spent, cell = heapq.heappop(open_)
        if cell == last:
            return list(_back(before, cell))[::-1]
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            near = cell[0] + dx, cell[1] + dy
            if not (0 <= near[0] < room.shape[0] and 0 <= near[1] < room.shape[1] and room[near]):
                continue
            total = spent + 1 + DETOUR / float(room[near]) ** 2
            if total < cost.get(near, math.inf):
                cost[near], before[near] = total, cell
                heapq.heappush(open_, (total, near))
    return []


def _back(before: Mapping[tuple[int, int], tuple[int, int] | None], cell: tuple[int, int]) -> Iterator[tuple[int, int]]:
    at: tuple[int, int] | None = cell
    while at is not None:
        yield at
        at = before[at]


def _runs(narrow: Sequence[int]) -> Iterator[list[int]]:
    """Yield the numbers of the cells of each stretch that is narrow all along."""
    for is_narrow, run in itertools.groupby(range(len(narrow)), key=lambda place: narrow[place] <= NARROW):
        if is_narrow:
            yield list(run)
