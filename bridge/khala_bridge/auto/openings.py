"""Tags and places with which a rule finds what it looks for: the arguments that a text can suggest.

The rules refuse everything else, by the same grids and lists. All of it is about the beginning of a turn, before any
call has spent or promised something, and kept with the land of the moment, since the same answer serves many actions.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_bridge.auto.aims import aim_of, unfit
from khala_bridge.auto.build import NEAR, free_geysers, is_gas, structure_of
from khala_bridge.auto.chrono import boostable, working
from khala_bridge.auto.places import is_held
from khala_bridge.auto.rule import NotAvailable, RuleRequest
from khala_bridge.auto.sites import NO_ORDERS, footprint_need, legal, near, on_corner
from khala_bridge.auto.spread import TUMOR_REACH
from khala_bridge.auto.warp import fields
from khala_bridge.frames import CAMERA_WIDTH, WorldPoint
from khala_bridge.state.ground import land_of, sites
from khala_bridge.state.ground.land import SEEN_NOW
from khala_bridge.state.side import is_structure, own_structures, place

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from khala_bridge.catalogue.action import Action
    from khala_bridge.frames import Camera, MapFrame
    from khala_bridge.rules import Ledger
    from khala_bridge.state import Snapshot, Unit
    from khala_bridge.state.ground import Land
    from khala_bridge.state.ground.footprints import Footprint
    from khala_bridge.state.ground.terrain import Bools

HALF: Final = CAMERA_WIDTH / 2
EDGE: Final = 0.5
"""World units by which a suggested place stays away from the edge of the screen."""
RASTER: Final = (0, -4, 4, -8, 8)
"""Offsets from the middle of a screen at which places are looked at, in world units."""


# tags -----------------------------------------------------------------------------------------------------------------


def tags_for(action: Action, snapshot: Snapshot, ledger: Ledger) -> list[int]:
    """Return tags with which a rule's action will do, the best ones first; all of them, or the nearest to own bases."""
    land = land_of(snapshot)
    key = "tags", action.rule, action.function, action.produces, action.target
    if key not in land.answers:
        ask = RuleRequest(action, snapshot, ledger)
        try:
            units = _TARGETS[action.rule or ""](ask)
        except NotAvailable:
            units = []
        land.answers[key] = [unit.tag for unit in units]
    found: list[int] = land.answers[key]
    return found


def _producing(ask: RuleRequest) -> list[Unit]:
    return [ask.snapshot.units[unit.tag] for unit in ask.able() if unit.orders]


def _under_construction(ask: RuleRequest) -> list[Unit]:
    return [u for u in own_structures(ask.snapshot) if u.build_progress < 1 and ask.has(u.tag)]


def _with_power(ask: RuleRequest) -> list[Unit]:
    return [ask.snapshot.units[field.tag] for field in fields(ask.snapshot) if field.room]


def _castable(ask: RuleRequest) -> list[Unit]:
    known = ask.snapshot.units.values()
    return [unit for unit in known if not unit.is_enemy and unfit(ask.snapshot.facts, ask.action, aim_of(unit)) is None]


def _to_boost(ask: RuleRequest) -> list[Unit]:
    """Return the structures at work that are not boosted; if there are none, those that could work."""
    return working(ask) or boostable(ask)


def _own_units(ask: RuleRequest) -> list[Unit]:
    return [unit for unit in ask.snapshot.own if not is_structure(unit)]


def _near_which(ask: RuleRequest) -> list[Unit]:
    """Return what a structure can be built near: free geysers, resources of free base places, or own structures."""
    land = land_of(ask.snapshot)
    structure = structure_of(ask)
    if is_gas(ask):
        return _nearest_first(land, free_geysers(ask))
    if sites()[structure].clear:
        return _of_bases(ask, land)
    allowed = legal_now(land, structure)
    corner = on_corner(structure)
    return [unit for unit in own_structures(ask.snapshot) if _has_cell(allowed, unit, NEAR, corner=corner)]


def _of_bases(ask: RuleRequest, land: Land | None = None) -> list[Unit]:
    """Return a mineral field for each base place where the structure can stand: the nearest to its middle."""
    land = land or land_of(ask.snapshot)
    structure = structure_of(ask)
    footprint = footprint_need(structure)
    allowed = legal_now(land, structure)
    free = [base for base in land.bases if allowed[footprint.cell(*base.place)] and not is_held(land, base.place)]
    fields = {(round(unit.pos.x, 3), round(unit.pos.y, 3)): unit for unit in land.standing("mineral_field")}
    nearest = (min(base.fields, key=lambda at: (math.dist(at, base.place), at)) for base in free if base.fields)
    return _nearest_first(land, (fields[at] for at in nearest if at in fields))


def _nearest_first(land: Land, units: Iterable[Unit]) -> list[Unit]:
    halls = [place(hall) for hall in land.own_halls]

    def away(unit: Unit) -> tuple[float, int]:
        return min((math.dist(place(unit), hall) for hall in halls), default=0.0), unit.tag

    return sorted(units, key=away)


def _has_cell(allowed: Bools, unit: Unit, reach: float, *, corner: bool) -> bool:
    """Return True if a grid has a marked cell within reach of a unit."""
    x0, y0 = max(int(unit.pos.x - reach), 0), max(int(unit.pos.y - reach), 0)
    part = allowed[x0 : int(unit.pos.x + reach) + 1, y0 : int(unit.pos.y + reach) + 1]
    x, y = np.nonzero(part)
    shift = 0.0 if corner else 0.5
    return bool(np.any(np.hypot(x + x0 + shift - unit.pos.x, y + y0 + shift - unit.pos.y) <= reach))


_TARGETS: Final[dict[str, Callable[[RuleRequest], list[Unit]]]] = {
    "stop_building": _producing,
    "cancel_building": _under_construction,
    "warp_near": _with_power,
    "cast": _castable,
    "chrono_unit": _to_boost,
    "recall_near": _own_units,
    "build_near": _near_which,
    "lock_base": _of_bases,
}
"""By rule, the units that it can be given."""


# places ---------------------------------------------------------------------------------------------------------------


def legal_now(land: Land, structure: str) -> Bools:
    """Return `legal` at the beginning of a turn; structures of the same needs share the answer."""
    site = sites()[structure]
    key = "legal", site.ground, site.clear, site.seen, footprint_need(structure).rows
    if key not in land.answers:
        land.answers[key] = legal(land, NO_ORDERS, structure)
    found: Bools = land.answers[key]
    return found


def openings(action: Action, snapshot: Snapshot, camera: Camera, world: MapFrame, most: int) -> list[WorldPoint]:
    """Return places on a screen where `build_at` accepts an action's structure, the nearest to its middle first."""
    land = land_of(snapshot)
    ask = RuleRequest(action, snapshot, NO_ORDERS)
    structure = structure_of(ask)
    if is_gas(ask):
        return [at for at in map(place, free_geysers(ask)) if _shows(camera, world, at)][:most]
    site = sites()[structure]
    footprint = footprint_need(structure)
    if site.clear:
        allowed = legal_now(land, structure)
        free = [base.place for base in land.bases if allowed[footprint.cell(*base.place)]]
        return [at for at in free if _shows(camera, world, at)][:most]
    key = "openings", site.ground, site.seen, footprint.rows, camera, most
    if key not in land.answers:
        land.answers[key] = _spread(land, legal_now(land, structure), footprint, camera, world, most)
    found: list[WorldPoint] = land.answers[key]
    return found


def tumor_places(
    tumors: list[WorldPoint], snapshot: Snapshot, camera: Camera, world: MapFrame, most: int
) -> list[WorldPoint]:
    """Return places on a screen for a creep tumor, the nearest to its middle first; within reach of all `tumors`."""
    land = land_of(snapshot)
    free = land.free & land.creep & (land.sight >= SEEN_NOW)
    for tumor in tumors:
        free &= near(land, [tumor], reach=TUMOR_REACH) < np.inf
    return _spread(land, free, footprint_need("CreepTumor"), camera, world, most)


def _spread(
    land: Land, fit: Bools, footprint: Footprint, camera: Camera, world: MapFrame, most: int
) -> list[WorldPoint]:
    """Return free places that do not overlap, out of the workers' ways if there are any."""
    reach = HALF - EDGE
    left, bottom, right, top = world.playable
    x0, y0 = max(math.ceil(max(camera.x - reach, left)), 0), max(math.ceil(max(camera.y - reach, bottom)), 0)
    part = np.s_[x0 : math.floor(min(camera.x + reach, right)), y0 : math.floor(min(camera.y + reach, top))]
    allowed = fit[part]
    aside = allowed & ~land.kept[part]
    cells = np.argwhere(aside if aside.any() else allowed)
    away = np.hypot(cells[:, 0] + x0 + 0.5 - camera.x, cells[:, 1] + y0 + 0.5 - camera.y)
    cells = cells[np.argsort(away, kind="stable")]
    found: list[WorldPoint] = []
    while len(cells) and len(found) < most:
        found.append(footprint.middle((int(cells[0, 0]) + x0, int(cells[0, 1]) + y0)))
        cells = cells[np.abs(cells - cells[0]).max(axis=1) > max(footprint.size)]
    return found


def _shows(camera: Camera, world: MapFrame, at: WorldPoint) -> bool:
    """Return True if a place is on a screen and on the map, and not at the very edge."""
    return abs(at.x - camera.x) <= HALF - EDGE and abs(at.y - camera.y) <= HALF - EDGE and world.holds(at)


def seen_points(snapshot: Snapshot, camera: Camera, world: MapFrame, most: int) -> list[WorldPoint] | None:
    """Return some places on a screen that are in sight, from its middle outwards; None if all of it is in sight."""
    sight = land_of(snapshot).sight
    x0, y0 = max(math.floor(camera.x - HALF), 0), max(math.floor(camera.y - HALF), 0)
    part = sight[x0 : math.ceil(camera.x + HALF), y0 : math.ceil(camera.y + HALF)]
    if bool((part == SEEN_NOW).all()):
        return None
    tried = (WorldPoint(camera.x + dx, camera.y + dy) for dx in RASTER for dy in RASTER)
    seen = [at for at in tried if world.holds(at) and sight[int(at.x), int(at.y)] == SEEN_NOW]
    return sorted(seen, key=lambda at: (round(math.dist(at, (camera.x, camera.y)), 3), at))[:most]
