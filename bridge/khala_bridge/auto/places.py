"""Which of the free places the host takes when an agent leaves it open."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_bridge.auto.rule import not_available
from khala_bridge.auto.sites import BASE_REACH, best, footprint_need, good, legal, near, new_power, on_corner
from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground import land_of
from khala_bridge.state.side import finished, place

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.rules import Ledger
    from khala_bridge.state import Unit
    from khala_bridge.state.ground import Land
    from khala_bridge.state.ground.terrain import Floats

OWN_GAS: Final = 10.0
"""A geyser so near to a town hall belongs to it; farther ones are not worth the way."""
PYLON_WISH: Final = 40.0
"""A Pylon that powers so many new places is as good as one that powers more; about half of what is possible."""
PYLON_AWAY: Final = 7.0
"""How far from its town hall a Pylon stands best, in world units."""
OUTWARD: Final = 7.0
"""How far in front of a town hall its defence stands, in world units."""
FRONT: Final = frozenset({"PhotonCannon", "ShieldBattery", "Bunker", "SpineCrawler"})
"""Structures that stand where the enemy comes from."""
AMONG_WORKERS: Final = frozenset({"MissileTurret", "SporeCrawler"})
"""Structures that guard workers from the air."""


def for_structure(land: Land, ledger: Ledger, structure: str) -> tuple[int, int] | None:
    """The cell of the best place at the own bases for a structure that is no town hall and on no geyser, if any."""
    grid, corner = good(land, ledger, structure), on_corner(structure)
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


def _anchors(land: Land) -> list[WorldPoint]:
    """What a base is when it has no town hall, or no room: everything own that stands."""
    return [place(u) for kind in ("town_hall", "square_3", "square_2") for u in _own(land.standing(kind))]


def _own(units: list[Unit]) -> list[Unit]:
    return [unit for unit in units if unit.is_own]


def _for_pylon(land: Land, ledger: Ledger, halls: list[WorldPoint]) -> Floats:
    """(w, h) cost of a place for a Pylon: few new places in its field, and far from where it stands best."""
    away = near(land, halls, reach=BASE_REACH, corner=True)
    power = np.minimum(new_power(land, ledger), PYLON_WISH)
    cost: Floats = np.abs(away - PYLON_AWAY) + (PYLON_WISH - power) / 2
    return cost


def front(land: Land, hall: WorldPoint) -> WorldPoint:
    """The point in front of a town hall: on the side from which an enemy walks to it."""
    enemies = [start for start in land.ground.starts if math.dist(start, hall) > OUTWARD]
    if not enemies:
        return hall
    ways = np.min([land.ground.ways_from(start) for start in enemies], axis=0)
    around = near(land, [hall], reach=OUTWARD) < np.inf
    cell = best(around & land.ground.walkable, ways + near(land, [hall]) / 1000)
    return hall if cell is None else WorldPoint(cell[0] + 0.5, cell[1] + 0.5)


def workplace(land: Land, hall: WorldPoint) -> WorldPoint:
    """The middle of the ways that the workers of a town hall walk."""
    of_base = next((base for base in land.bases if math.dist(base.place, hall) < OWN_GAS), None)
    if of_base is None or not of_base.fields:
        return hall
    x, y = np.mean([*of_base.fields, *[hall] * len(of_base.fields)], axis=0).tolist()
    return WorldPoint(x, y)


def free_base(ask: RuleRequest, land: Land, structure: str) -> WorldPoint:
    """The place for a town hall that is the shortest way from the own bases.

    Raises:
        NotAvailable: every place that can be walked to is taken.
    """
    footprint = footprint_need(structure)
    allowed = legal(land, ask.ledger, structure)
    places = [
        base.place for base in land.bases if allowed[footprint.cell(*base.place)] and not _is_held(land, base.place)
    ]
    ways = [land.ground.ways_from(place(hall)) for hall in land.own_halls]

    def way(to: WorldPoint) -> tuple[float, WorldPoint]:
        return min((float(far[int(to.x), int(to.y)]) for far in ways), default=0.0), to

    reached = [to for to in places if math.isfinite(way(to)[0])]
    if not reached:
        raise not_available(ask, "every place for a town hall that can be walked to is taken.")
    return min(reached, key=way)


def _is_held(land: Land, place_: WorldPoint) -> bool:
    """Whether somebody's town hall stands at a place or near it, or one of an enemy who began there is likely to."""
    unseen = not land.sight[int(place_.x), int(place_.y)]
    begun = unseen and any(math.dist(start, place_) < OWN_GAS for start in land.ground.starts)
    return begun or any(math.dist(place(hall), place_) < OWN_GAS for hall in land.halls)


def free_geyser(ask: RuleRequest, geysers: list[Unit]) -> Unit:
    """The free geyser that is nearest to a finished town hall.

    Raises:
        NotAvailable: no town hall has one.
    """
    halls = finished(land_of(ask.snapshot).own_halls)

    def away(geyser: Unit) -> tuple[float, int]:
        return min((math.dist(place(geyser), place(hall)) for hall in halls), default=math.inf), geyser.tag

    found = min(geysers, key=away, default=None)
    if found is None or away(found)[0] > OWN_GAS:
        raise not_available(ask, "no finished base of yours has a free geyser; build another base first.")
    return found
