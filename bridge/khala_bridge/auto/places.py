"""The choice of one free place when an agent leaves it open."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_bridge.auto.rule import not_available
from khala_bridge.auto.sites import (
    BASE_REACH,
    any_good,
    best,
    footprint_need,
    good,
    legal,
    near,
    new_power,
    on_corner,
)
from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground import land_of
from khala_bridge.state.side import finished, place

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.auto.sites import Costs
    from khala_bridge.rules import Ledger
    from khala_bridge.state import Unit
    from khala_bridge.state.ground import Land

OWN_GAS: Final = 10.0
"""A geyser within this distance of a town hall belongs to it; farther ones are not worth the way."""
PYLON_WISH: Final = 40.0
"""A Pylon that powers this many new places is as good as one that powers more; about half of what is possible."""
PYLON_AWAY: Final = 7.0
"""Best distance of a Pylon from its town hall, in world units."""
OUTWARD: Final = 7.0
"""Distance of a town hall's defence in front of it, in world units."""
FRONT: Final = frozenset({"PhotonCannon", "ShieldBattery", "Bunker", "SpineCrawler"})
"""Structures that stand on the enemy's side of a base."""
AMONG_WORKERS: Final = frozenset({"MissileTurret", "SporeCrawler"})
"""Structures that guard workers from the air."""


def for_structure(land: Land, ledger: Ledger, structure: str) -> tuple[int, int] | None:
    """Return the best cell at the own bases for a structure, if any; not for town halls and gas structures."""
    grid = good(land, ledger, structure)
    corner = on_corner(structure)
    halls = [place(unit) for unit in land.own_halls]
    if structure == "Pylon":
        found = best(grid, _for_pylon(land, ledger, halls))
    else:
        wanted = halls
        if structure in FRONT:
            wanted = [front(land, hall) for hall in halls]
        elif structure in AMONG_WORKERS:
            wanted = [workplace(land, hall) for hall in halls]
        found = best(grid, near(land, wanted, reach=BASE_REACH, corner=corner))
    return found or best(grid, near(land, _anchors(land), corner=corner))


def has_room(land: Land, structure: str) -> bool:
    """Return True if `for_structure` finds a cell at the beginning of a turn; it takes a tenth of its time."""
    return any_good(land, structure) and bool(land.own_halls or _anchors(land))


def _anchors(land: Land) -> list[WorldPoint]:
    """Return the points that make up a base without a town hall or without room: all own structures."""
    return [place(u) for kind in ("town_hall", "square_3", "square_2") for u in _own(land.standing(kind))]


def _own(units: list[Unit]) -> list[Unit]:
    return [unit for unit in units if unit.is_own]


def _for_pylon(land: Land, ledger: Ledger, halls: list[WorldPoint]) -> Costs:
    """Return the cost (w, h) of a place for a Pylon: high for few new places in its field, or a wrong distance."""
    away = near(land, halls, reach=BASE_REACH, corner=True)
    power = np.minimum(new_power(land, ledger), PYLON_WISH)
    cost: Costs = np.abs(away - PYLON_AWAY) + (PYLON_WISH - power) / 2
    return cost


def front(land: Land, hall: WorldPoint) -> WorldPoint:
    """Return the point in front of a town hall, on the side from which an enemy arrives."""
    enemies = [start for start in land.ground.starts if math.dist(start, hall) > OUTWARD]
    if not enemies:
        return hall
    ways = np.min([land.ground.ways_from(start) for start in enemies], axis=0)
    around = near(land, [hall], reach=OUTWARD) < np.inf
    cell = best(around & land.ground.walkable, ways + near(land, [hall]) / 1000)
    return hall if cell is None else WorldPoint(cell[0] + 0.5, cell[1] + 0.5)


def workplace(land: Land, hall: WorldPoint) -> WorldPoint:
    """Return the middle of the workers' ways at a town hall."""
    of_base = next((base for base in land.bases if math.dist(base.place, hall) < OWN_GAS), None)
    if of_base is None or not of_base.fields:
        return hall
    x, y = np.mean([*of_base.fields, *[hall] * len(of_base.fields)], axis=0).tolist()
    return WorldPoint(x, y)


def free_base(ask: RuleRequest, land: Land, structure: str) -> WorldPoint:
    """Return the free place for a town hall with the shortest way from the own bases.

    Raises:
        NotAvailable: every place that workers can walk to is taken.
    """
    footprint = footprint_need(structure)
    allowed = legal(land, ask.ledger, structure)
    places = [
        base.place for base in land.bases if allowed[footprint.cell(*base.place)] and not is_held(land, base.place)
    ]
    ways = [land.ground.ways_from(place(hall)) for hall in land.own_halls]

    def way(to: WorldPoint) -> tuple[float, WorldPoint]:
        return min((float(far[int(to.x), int(to.y)]) for far in ways), default=0.0), to

    reached = [to for to in places if math.isfinite(way(to)[0])]
    if not reached:
        raise not_available(ask, "every place for a town hall that can be walked to is taken.", "no free base place")
    return min(reached, key=way)


def is_held(land: Land, place_: WorldPoint) -> bool:
    """Return True if a town hall stands at or near a place, or if it is an unseen start of an enemy."""
    unseen = not land.sight[int(place_.x), int(place_.y)]
    begun = unseen and any(math.dist(start, place_) < OWN_GAS for start in land.ground.starts)
    return begun or any(math.dist(place(hall), place_) < OWN_GAS for hall in land.halls)


def free_geyser(ask: RuleRequest, geysers: list[Unit]) -> Unit:
    """Return the free geyser that is nearest to a finished town hall.

    Raises:
        NotAvailable: no town hall has one.
    """
    halls = finished(land_of(ask.snapshot).own_halls)

    def away(geyser: Unit) -> tuple[float, int]:
        return min((math.dist(place(geyser), place(hall)) for hall in halls), default=math.inf), geyser.tag

    found = min(geysers, key=away, default=None)
    if found is None or away(found)[0] > OWN_GAS:
        why = "no finished base of yours has a free geyser; build another base first."
        raise not_available(ask, why, "no free geyser at your bases")
    return found
