"""Sites: where a computer player puts its structures.

Around a base, with a way around each of them unless the creep is too small for that; not between a town hall and its
resources, not where another base's town hall will stand, and not on a ramp. Candidates are found on grids of the whole
map, then judged by the game's rules.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities.protoss import warpgate
from khala_simulator.abilities.terran import addons
from khala_simulator.economy import building_sites, power
from khala_simulator.opponent import bases
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.maps.game_map import GameMap
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Point
    from khala_simulator.world.columns import Bools, Floats, Ints

NEAREST, FARTHEST = 4.0, 18.0
"""How far from the base's town hall a structure stands."""
PYLONS_APART: Final = 4.5
POWERED: Final = 6.5
"""How far from a Pylon a structure can stand."""
ROOMY: Final = 0.5
"""A Pylon powers at least this share of the room that the best place for one would."""
TRIES: Final = 10
"""How many candidates the rules judge before the search ends."""
WITH_ADDON: Final = frozenset({"Barracks", "Factory", "Starport"})
ADDON_CELLS: Final = 2
FORWARD: Final = frozenset({"Bunker", "PhotonCannon", "ShieldBattery", "SpineCrawler"})
"""Structures that stand at the base nearest to the enemy, on its side."""
FORWARD_BY: Final = 6.0
WARP_STEP: Final = 1.5
WARP_SOURCES: Final = 3
"""How many Pylons are tried for a place to warp in."""


def place_for(side: OwnSide, unit: UnitType, near: Point | None = None) -> Point | None:
    """Return where a structure of a type is to stand, or None without a place; ``near`` a point if one is given."""
    if unit.name == side.race.hall:
        return near
    if unit.name == side.race.gas:
        return None
    if near is not None:
        return _nearest(side, unit, near)
    if unit.name in FORWARD:
        return _nearest(side, unit, _forward(side))
    around = [side.place(hall) for hall in side.halls] or [side.mind.bases[0]]
    if unit.name == side.race.supply:
        around = around[side.count(unit.name) % len(around) :] + around[: side.count(unit.name) % len(around)]
    return next((place for base in around if (place := _nearest(side, unit, base)) is not None), None)


def _forward(side: OwnSide) -> Point:
    """Return a point in front of the base nearest to the enemy."""
    (x, y), (ex, ey) = bases.front(side), side.mind.enemy_start
    length = max(math.dist((x, y), (ex, ey)), 1.0)
    return x + (ex - x) / length * FORWARD_BY, y + (ey - y) / length * FORWARD_BY


def _nearest(side: OwnSide, unit: UnitType, near: Point) -> Point | None:
    footprint = building_sites.footprint_of(side.world, unit)
    if footprint is None:
        return None
    at = _centres(side, unit, footprint.size)
    if unit.needs_creep and not len(at):
        at = _centres(side, unit, footprint.size, way=0)
    offset = np.hypot(*(at - np.array(near)).T)
    far = (offset >= (NEAREST if near in side.mind.bases else 0.0)) & (offset <= FARTHEST)
    at, offset = at[far], offset[far]
    if unit.needs_power or unit.name == "Pylon":
        powered = _by_pylons(side, unit, at)
        at, offset = at[powered], offset[powered]
    for index in np.lexsort((at[:, 0], at[:, 1], np.round(offset, 3)))[:TRIES].tolist():
        x, y = at[index].tolist()
        if building_sites.refusal(side.world, side.player, unit, (x, y)) is ActionResult.SUCCESS:
            return x, y
    return None


def _by_pylons(side: OwnSide, unit: UnitType, at: Floats) -> Bools:
    """Return which places suit the Pylons: in a power field, or for a Pylon away from the others."""
    if unit.needs_power:
        powered = np.zeros(len(at), dtype=np.bool_)
        for source in power.sources(side.world, side.player):
            powered |= power.covers(side.world, source, at)
        return powered
    pylons = side.world.pos[side.of_type("Pylon") + side.begun.get("Pylon", [])]
    apart = (np.hypot(at[:, None, 0] - pylons[:, 0], at[:, None, 1] - pylons[:, 1]) >= PYLONS_APART).all(axis=1)
    room = _room(side, at)
    return np.asarray(apart & (room >= ROOMY * room[apart].max(initial=0)), dtype=np.bool_)


def _room(side: OwnSide, at: Floats) -> Ints:
    """Return how many places for a Gateway Pylons would power."""
    gateway = _centres(side, side.world.catalog.unit(side.race.producer), (3, 3))
    powered: Ints = (np.hypot(gateway[:, None, 0] - at[:, 0], gateway[:, None, 1] - at[:, 1]) <= POWERED).sum(axis=0)
    return powered


# grids ----------------------------------------------------------------------------------------------------------------


def _centres(side: OwnSide, unit: UnitType, size: tuple[int, int], way: int = 1) -> Floats:
    """Return (k, 2) the centres where a structure and a way of so many cells around it find room."""
    world = side.world
    open_ground = world.map.terrain.build & ~building_sites.taken(world)
    open_ground = open_ground & ~_kept_free(world.map, side.mind.bases, side.mind.resources) & ~_for_addons(side)
    if unit.needs_creep:
        open_ground = open_ground & world.creep
    elif unit.name != side.race.hall and (side.owner.race == "zerg" or world.creep.any()):
        open_ground = open_ground & ~world.creep
    extra = ADDON_CELLS if unit.name in WITH_ADDON else 0
    width, height = size[0] + 2 * way + extra, size[1] + 2 * way
    sums = np.pad(np.cumsum(np.cumsum(open_ground, axis=0, dtype=np.int64), axis=1), ((1, 0), (1, 0)))
    inside = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width] + sums[:-height, :-width]
    y, x = np.nonzero(inside == width * height)
    return np.stack([x + way + size[0] / 2.0, y + way + size[1] / 2.0], axis=1)


def _for_addons(side: OwnSide) -> Bools:
    """Return (h, w) the cells at the side of own structures where their add-ons stand, or will."""
    kept = np.zeros_like(side.world.map.terrain.build)
    for name in WITH_ADDON:
        for slot in (*side.whole.get(name, ()), *side.begun.get(name, ())):
            _mark(kept, np.array(addons.place_of(side.world, slot)), 0.9)
    return kept


@lru_cache(maxsize=16)
def _kept_free(game_map: GameMap, places: tuple[Point, ...], resources: tuple[Point, ...]) -> Bools:
    """Return (h, w) cells for town halls, for the ways of workers, and around ground on which nothing can be built."""
    terrain = game_map.terrain
    ramp = terrain.walk & ~terrain.build
    free = ramp.copy()
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            free |= np.roll(ramp, (dy, dx), axis=(0, 1))
    for place in places:
        _mark(free, np.array(place), 3.6)
        for resource in resources:
            if math.dist(place, resource) <= MECHANICS.harvest_search:
                for share in np.linspace(0.3, 1.0, 8):
                    _mark(free, np.array(place) * (1 - share) + np.array(resource) * share, 1.6)
    return free


def _mark(grid: Bools, centre: Floats, half: float) -> None:
    (x, y), (height, width) = centre.tolist(), grid.shape
    grid[
        max(0, int(y - half)) : min(height, int(y + half) + 1), max(0, int(x - half)) : min(width, int(x + half) + 1)
    ] = True


# geysers and warping in -----------------------------------------------------------------------------------------------


def geyser(side: OwnSide) -> int:
    """Return a free geyser at an own finished town hall, or NOBODY."""
    world = side.world
    ordered = {world.slot_of(order.target) for w in side.workers if world.casts[w] for order in world.orders_of(w)}
    free = [s for s in world.live.tolist() if s not in ordered and building_sites.is_free_geyser(world, s)]
    for hall in side.halls:
        near = [s for s in free if math.dist(side.place(s), side.place(hall)) <= MECHANICS.harvest_search]
        if near:
            nearest: int = min(near, key=lambda s: (math.dist(side.place(s), side.place(hall)), s))
            return nearest
    return NOBODY


def warp_place(side: OwnSide, unit: UnitType) -> Point | None:
    """Return where to warp a unit in: at the Pylon nearest to the front, a fast one if there is any."""
    world = side.world
    front = bases.front(side)
    sources = sorted(power.sources(world, side.player), key=lambda s: (not s.fast, math.dist(s.point, front), s.slot))
    for source in sources[:WARP_SOURCES]:
        for dx, dy in _around(source.radius):
            point = source.point[0] + dx, source.point[1] + dy
            if warpgate.refusal(world, side.player, unit, point) is ActionResult.SUCCESS:
                return point
    return None


@lru_cache(maxsize=4)
def _around(radius: float) -> tuple[Point, ...]:
    """Return offsets all over a power field, the outermost first."""
    steps = np.arange(-radius, radius + 0.1, WARP_STEP).tolist()
    inside = [(x, y) for x in steps for y in steps if 1.0 < math.hypot(x, y) < radius]
    return tuple(sorted(inside, key=lambda at: (-math.hypot(*at), at)))
