"""Whether an order follows from a message: it names something that the message names.

Points on a screen are not compared: each reader has its own. `khala_sc2.experiment.measures.communication` says more, and
counts by it; `khala_sc2.dataset.credit` rewards by it.
"""

from __future__ import annotations

import math
import re
from functools import cache
from typing import TYPE_CHECKING

from khala_bridge.knowledge import knowledge

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from khala_protocol.messages import Observation, Point, UnitView

NEAR_MINIMAP = 4.0
"""Cells of the minimap, 1/16 of its width, within which two points are the same place."""
_TAG = re.compile(r"0x[0-9a-f]+", re.IGNORECASE)
_POINT = re.compile(r"[\[(]\s*(\d+(?:\.\d+)?)\s*,\s*(\d+(?:\.\d+)?)\s*[\])]")
_ORDER = re.compile(r"<(?:Standing\()?(\w+)(.*)>", re.DOTALL)


def tags(text: str) -> frozenset[str]:
    """Return the tags in a text, in small letters."""
    return frozenset(tag.casefold() for tag in _TAG.findall(text))


def is_acted_on(text: str, orders: Collection[str], seen: Observation | None) -> bool:
    """Return True if any of these orders names what a message names.

    Args:
        text: of the message.
        orders: as they were accepted, `Stalker-1 <Attack_Unit(0x1)>`.
        seen: the observation in which the reader found the message.
    """
    named = tags(text)
    points = [*_points(text), *_places(text, seen)]
    types = {unit.tag.casefold(): unit.type for unit in _units(seen)}
    for name, arguments in (found.groups() for order in orders if (found := _ORDER.search(order))):
        targets = tags(arguments)
        if not named.isdisjoint(targets):
            return True
        if any(_names_type(text, type_) for type_ in (*name.split("_"), *(types.get(tag, "") for tag in targets))):
            return True
        goals = _points(arguments) if name.endswith("_Minimap") else ()
        if any(math.dist(goal, point) <= NEAR_MINIMAP for goal in goals for point in points):
            return True
    return False


def _points(text: str) -> list[Point]:
    return [(float(x), float(y)) for x, y in _POINT.findall(text)]


def _places(text: str, seen: Observation | None) -> Iterator[Point]:
    """Yield the points of the named places in a text."""
    for place in seen.view.places if seen else ():
        if re.search(rf"\b{re.escape(place.name)}\b", text, re.IGNORECASE):
            yield place.minimap


def _units(seen: Observation | None) -> Iterator[UnitView]:
    for team in seen.view.teams if seen else ():
        yield from (*team.units, *team.allies, *team.enemies, *team.resources)


def _names_type(text: str, word: str) -> bool:
    """Return True if a word is a type of unit, and the text names it, in one word or several, one or many."""
    return word in knowledge() and _name_pattern(word).search(text) is not None


@cache
def _name_pattern(type_: str) -> re.Pattern[str]:
    return re.compile(rf"\b{re.sub(r'(?<=[a-z])(?=[A-Z])', ' ?', type_)}e?s?\b", re.IGNORECASE)
