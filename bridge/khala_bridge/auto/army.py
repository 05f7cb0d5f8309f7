"""Orders to the whole army, with the plain meaning of their words; the host finds the place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_bridge.auto.places import front
from khala_bridge.auto.rule import RuleOrder, not_available
from khala_bridge.auto.scouting import unseen_places
from khala_bridge.catalogue.functions import functions
from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground import land_of
from khala_bridge.state.side import (
    army,
    enemies_in_reach,
    enemy_structures,
    is_armed,
    is_structure,
    own_structures,
    place,
)

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.state import Unit

NEAR_ARMY: Final = 24.0
"""Enemies within this distance of the middle of the army are fought first; the figure of LLM-PySC2's code."""
NEAR_ONE: Final = 20.0
"""Enemies within this distance of any unit of the army, too; the figure of LLM-PySC2's code."""
INTRUDES: Final = 15.0
"""Enemies within this distance of an own structure are intruders; the figure of LLM-PySC2's code."""


def army_attack(ask: RuleRequest) -> list[RuleOrder]:
    """Send the army, fighting, to enemies near it, else to the nearest known enemy structure, else to unseen places.

    Among the enemies near it, those that fight come first, then structures and workers.

    Raises:
        NotAvailable: there is no army that is free.
    """
    units = free_army(ask)
    middle = _middle(units)
    close = [u for u in enemies_in_reach(ask.snapshot, units) if _is_close(u, units, middle)]
    known = [unit for unit in close if is_armed(unit)] or close or enemy_structures(ask.snapshot)
    if known:
        return _send(ask, units, _nearest(known, [middle]), fight=True)
    return _send(ask, units, unseen_places(ask.snapshot, middle)[0], fight=True)


def army_defend(ask: RuleRequest) -> list[RuleOrder]:
    """Send the army against intruders, those nearest to a town hall first; without any, in front of the foremost base.

    Queens fight intruders too, and do not wait.

    Raises:
        NotAvailable: there is no army that is free.
    """
    units = home_army(ask)
    if intruders := _intruders(ask, units):
        halls = [place(hall) for hall in land_of(ask.snapshot).own_halls]
        return _send(ask, units, _nearest(intruders, halls or _homes(ask)), fight=True)
    return _send(ask, units, _rally(ask, _middle(units)), fight=True)


def army_retreat(ask: RuleRequest) -> list[RuleOrder]:
    """Send the army back to the foremost base without fighting.

    Raises:
        NotAvailable: there is no army that is free, or nothing to retreat to.
    """
    units = army_with_base(ask)
    return _send(ask, units, _rally(ask, _middle(units)), fight=False)


def army_with_base(ask: RuleRequest) -> list[Unit]:
    """Return the free army of a side that has something to retreat to.

    Raises:
        NotAvailable: it has none, or no army.
    """
    units = free_army(ask)
    if not own_structures(ask.snapshot):
        raise not_available(ask, "you have no base to retreat to; name a place with a Move action.", "no base")
    return units


def home_army(ask: RuleRequest) -> list[Unit]:
    """Return the free army and the Queens, which leave their work only for intruders.

    Raises:
        NotAvailable: there is neither, or only Queens and no intruder.
    """
    units = free_army(ask, home=True)
    return units if _intruders(ask, units) else free_army(ask)


def free_army(ask: RuleRequest, *, home: bool = False) -> list[Unit]:
    """Return the army without the units that an agent has ordered in this turn.

    Raises:
        NotAvailable: there is none.
    """
    found = army(ask.snapshot, home=home)
    if not found:
        raise not_available(ask, "you have no army; train units first.", "no army")
    free = [unit for unit in found if unit.tag not in ask.ledger.busy]
    if not free:
        raise not_available(ask, "every unit of the army has an order already in this turn.")
    return free


def _homes(ask: RuleRequest) -> list[WorldPoint]:
    return [place(unit) for unit in own_structures(ask.snapshot)]


def _intruders(ask: RuleRequest, units: list[Unit]) -> list[Unit]:
    """Return the enemies near own structures that some units can fight."""
    homes = _homes(ask)
    enemies = [unit for unit in enemies_in_reach(ask.snapshot, units) if not is_structure(unit) or is_armed(unit)]
    return [u for u in enemies if any(math.dist(place(u), home) <= INTRUDES for home in homes)]


def _middle(units: list[Unit]) -> WorldPoint:
    x, y = np.median([place(unit) for unit in units], axis=0).tolist()  # stragglers do not move it
    return WorldPoint(x, y)


def _is_close(unit: Unit, units: list[Unit], middle: WorldPoint) -> bool:
    at = place(unit)
    return math.dist(at, middle) <= NEAR_ARMY or any(math.dist(at, place(own)) <= NEAR_ONE for own in units)


def _nearest(units: list[Unit], to: list[WorldPoint]) -> WorldPoint:
    def away(unit: Unit) -> tuple[float, int]:
        return min((math.dist(place(unit), point) for point in to), default=0.0), unit.tag

    return place(min(units, key=away))


def _rally(ask: RuleRequest, middle: WorldPoint) -> WorldPoint:
    """Return the point in front of the base nearest to the enemy by its ways; the army's own place without a base."""
    land = land_of(ask.snapshot)
    fronts = [front(land, place(hall)) for hall in land.own_halls]
    enemies = land.ground.starts
    if not fronts:
        return min(_homes(ask), key=lambda home: (math.dist(home, middle), home), default=middle)
    if not enemies:
        return min(fronts, key=lambda point: (math.dist(point, middle), point))
    ways = np.min([land.ground.ways_from(start) for start in enemies], axis=0)
    return min(fronts, key=lambda point: (float(ways[int(point.x), int(point.y)]), point))


def _send(ask: RuleRequest, units: list[Unit], to: WorldPoint, *, fight: bool) -> list[RuleOrder]:
    tags = tuple(unit.tag for unit in units)
    ask.ledger.take(*tags)
    return [RuleOrder(functions()["Attack_minimap" if fight else "Move_minimap"], tags, to)]
