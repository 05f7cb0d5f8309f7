"""Power: which Pylons and phasing Warp Prisms supply the structures of their owner, and where units warp in fast.

Written into the column ``powered`` when a unit comes, goes or is finished; read by production, weapons and the API.
Above: ``systems.power``, ``building_sites``, ``skills.warpgate``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Bools, Floats
    from khala_simulator.world.world import World

SUPPLIES: Final = frozenset({"Pylon", "WarpPrismPhasing"})
"""Types that power structures; the others in the tables only hasten warping in."""
ALWAYS_FAST: Final = frozenset({"WarpPrismPhasing"})
CLIFF: Final = 0.5  # a Pylon does not power ground that lies so much higher than it


@dataclass(frozen=True, slots=True)
class PoweredArea:
    """A power field: the slot it is around, its middle, its radius, and whether units warp in fast in it."""

    slot: int
    point: tuple[float, float]
    radius: float
    fast: bool


@lru_cache(maxsize=4)
def _rows(catalog: Catalog) -> tuple[Bools, Bools]:
    """Return, by unit row, which types have a field of any kind, and which work only with power."""
    fields = np.array([bool(u.power) for u in catalog.units])
    return fields, np.array([u.needs_power for u in catalog.units])


def sources(world: World, player: int) -> list[PoweredArea]:
    """Return a player's power fields, by ascending slot."""
    live = world.live
    mine = live[_rows(world.catalog)[0][world.type[live]] & (world.owner[live] == player)]
    mine = mine[(world.build_progress[mine] >= 1.0) & ~world.hallucination[mine]]
    slots = mine.tolist()
    hasteners = [s for s in slots if world.unit_type(s).name not in SUPPLIES]
    return [_source(world, s, hasteners) for s in slots if world.unit_type(s).name in SUPPLIES]


def _source(world: World, slot: int, hasteners: list[int]) -> PoweredArea:
    unit = world.unit_type(slot)
    x, y = world.pos[slot].tolist()
    fast = unit.name in ALWAYS_FAST or any(
        float(np.hypot(*(world.pos[h] - world.pos[slot]))) <= max(r for r, _ in world.unit_type(h).power)
        for h in hasteners
    )
    return PoweredArea(slot, (x, y), max(radius for radius, _ in unit.power), fast)


def covers(world: World, source: PoweredArea, points: Floats) -> Bools:
    """Return (k,) which points (k, 2) lie in a field; a Pylon's does not reach up a cliff."""
    offset = points - np.array(source.point)
    inside: Bools = offset[:, 0] ** 2 + offset[:, 1] ** 2 <= source.radius**2
    if not world.unit_type(source.slot).flying and inside.any():
        height = world.map.terrain.ground_z(np.vstack([np.array(source.point)[None], points]))
        inside &= height[1:] <= height[0] + CLIFF
    return inside


def best(world: World, player: int, point: tuple[float, float]) -> PoweredArea | None:
    """Return the field over a point, a fast one if there is any; None without power."""
    at = np.array([point])
    found = [source for source in sources(world, player) if covers(world, source, at)[0]]
    return max(found, key=lambda source: source.fast, default=None)


def supply(world: World) -> list[int]:
    """Write ``powered`` of every structure that needs power; return those for which it changed."""
    live = world.live
    slots = live[_rows(world.catalog)[1][world.type[live]]]
    if not slots.size:
        return []
    powered = np.zeros(len(slots), dtype=np.bool_)
    for player in np.unique(world.owner[slots]).tolist():
        mine = world.owner[slots] == player
        for source in sources(world, player):
            powered |= mine & covers(world, source, world.pos[slots])
    changed: list[int] = slots[powered != world.powered[slots]].tolist()
    world.powered[slots] = powered
    return changed
