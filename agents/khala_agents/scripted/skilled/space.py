"""Places on a team's screen: distances, middles, crowds, and where to run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_agents.scripted.reading import TextUnit
from khala_agents.scripted.writing import inside

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from khala_agents.scripted.reading import Point, TextTeam

_DIRECTIONS = tuple((math.cos(k * math.pi / 8), math.sin(k * math.pi / 8)) for k in range(16))


def place(unit: TextUnit) -> Point:
    """Return the place of a unit on the screen."""
    return unit.x, unit.y


def distance(a: TextUnit | Point, b: TextUnit | Point) -> float:
    """Return the distance of two units or points of one screen, centre to centre."""
    (ax, ay), (bx, by) = _xy(a), _xy(b)
    return math.hypot(ax - bx, ay - by)


def _xy(what: TextUnit | Point) -> Point:
    return (what.x, what.y) if isinstance(what, TextUnit) else what


def middle(units: Sequence[TextUnit]) -> Point:
    """Return the mean place of some units."""
    return sum(unit.x for unit in units) / len(units), sum(unit.y for unit in units) / len(units)


def nearest(to: TextUnit | Point, units: Iterable[TextUnit]) -> TextUnit | None:
    """Return the nearest unit; of equally near ones the first."""
    return min(units, key=lambda unit: distance(to, unit), default=None)


def towards(begin: Point, end: Point, length: float) -> Point:
    """Return the point this far on the way from one to another; beyond it if the way is shorter."""
    way = distance(begin, end)
    if way < 1e-6:
        return end
    return begin[0] + (end[0] - begin[0]) * length / way, begin[1] + (end[1] - begin[1]) * length / way


def away(team: TextTeam, begin: Point, threats: Sequence[TextUnit], length: float) -> Point:
    """Return a point on the map about this far from a place that is as far from some threats as possible."""

    def safety(at: Point) -> tuple[float, float]:
        return min((distance(at, unit) for unit in threats), default=0.0), distance(at, begin)

    choices = [inside((begin[0] + dx * length, begin[1] + dy * length), team) for dx, dy in _DIRECTIONS]
    return max(choices, key=safety)


def crowd(
    targets: Sequence[TextUnit], radius: float, worth: Callable[[TextUnit], float], spared: Sequence[TextUnit] = ()
) -> tuple[float, Point] | None:
    """Return the place where a radius hits most, and its worth; None without targets.

    Args:
        targets: units to hit; the middle is tried on each of them and between near ones.
        radius: of the skill.
        worth: of one target.
        spared: units whose worth counts twice against a place.
    """
    best: tuple[float, Point] | None = None
    for centre in targets:
        near = [unit for unit in targets if distance(unit, centre) <= radius]
        for at in (place(centre), middle(near)):
            value = sum(worth(unit) for unit in targets if distance(unit, at) <= radius)
            value -= 2 * sum(worth(unit) for unit in spared if distance(unit, at) <= radius + 0.5)
            if best is None or value > best[0]:
                best = value, at
    return best
