"""Placement: where a new unit fits, as near as possible to the wanted point.

Units made at one point take the nearest free places of a fine grid, ring by ring, each ring from the south
counter-clockwise; bodies keep their radii apart. Inferred from where units of recorded games were born.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.movement import pathfinding
from khala_simulator.tables.layers import Layer, layer_of
from khala_simulator.tables.stats import LAYERS, bit_set
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.columns import Bools
    from khala_simulator.world.world import World

CANDIDATE_STEP = 0.25
SEARCH_RADII = (3.0, 6.0, 12.0)
ROUNDING = 1e-6


def free_places(world: World, unit: UnitType, point: tuple[float, float], count: int) -> list[tuple[float, float]]:
    """Return the places nearest to ``point`` where ``count`` new units touch no body, no wall and not each other.

    Units that find no place within the search radius stand on ``point``. Structures go on the cell grid, where their
    footprint fits it, all at the same place.
    """
    footprint = world.catalog.footprints.get(unit.footprint)
    if footprint is not None and footprint.cells:
        return [snap(point, footprint.size)] * count
    places: list[tuple[float, float]] = []
    for radius in SEARCH_RADII:
        places = _places_within(world, unit, point, count, radius)
        if len(places) == count:
            return places
    return places + [point] * (count - len(places))


def _places_within(
    world: World, unit: UnitType, point: tuple[float, float], count: int, radius: float
) -> list[tuple[float, float]]:
    at = candidates(world, unit, point, radius)
    bits = bit_set(unit.collide, LAYERS)
    places: list[tuple[float, float]] = []
    own = (2.0 * unit.radius - ROUNDING) ** 2
    while len(at) and len(places) < count:
        x, y = at[0].tolist()
        places.append((x, y))
        at = at[1:] if bits == 0 else at[(at[:, 0] - x) ** 2 + (at[:, 1] - y) ** 2 >= own]
    return places


def candidates(
    world: World, unit: UnitType, point: tuple[float, float], radius: float, *, ignoring: int = NOBODY
) -> Floats:
    """Return (k, 2) places within ``radius`` of a point where one more unit touches no body and no wall, nearest first.

    The body of the unit in the slot ``ignoring`` does not count.
    """
    at = np.array(point) + _offsets(radius)
    at = at[_on_surface(world, unit, at)]
    bits = bit_set(unit.collide, LAYERS)
    bodies = world.live[(world.layer_bits[world.live] & bits) != 0]
    bodies = bodies[bodies != ignoring]
    apart = world.radius[bodies] + unit.radius - ROUNDING
    offset = at[:, None, :] - world.pos[bodies]
    free: Floats = at[(offset[..., 0] ** 2 + offset[..., 1] ** 2 >= apart**2).all(axis=1)]
    return free


def snap(point: tuple[float, float], size: tuple[int, int]) -> tuple[float, float]:
    """Return the centre nearest to ``point`` at which a footprint of ``size`` cells lies on the grid."""
    x, y = (round(v - s / 2.0) + s / 2.0 for v, s in zip(point, size, strict=True))
    return x, y


def _on_surface(world: World, unit: UnitType, at: Floats) -> Bools:
    x0, y0, x1, y1 = world.map.terrain.playable
    inside: Bools = (at[:, 0] >= x0) & (at[:, 1] >= y0) & (at[:, 0] < x1) & (at[:, 1] < y1)
    layer = layer_of(unit)
    if layer is Layer.AIR:
        return inside
    surface = pathfinding.surface(world.ground, layer)
    return inside & surface.flat[surface.cell(at)]


@lru_cache(maxsize=16)
def _offsets(radius: float) -> Floats:
    """Return candidate offsets (k, 2), nearest first; equally near ones from the south counter-clockwise."""
    steps = round(radius / CANDIDATE_STEP)
    rings = sorted((a * a + b * b, a, b) for b in range(steps + 1) for a in range(b + 1))
    places: dict[tuple[int, int], None] = {}
    for squared, a, b in rings:
        if squared > steps * steps:
            break
        for x, y in ((a, -b), (-a, -b)):
            for _ in range(4):
                places[x, y] = None
                x, y = -y, x  # noqa: PLW2901
    return np.array(list(places)) * CANDIDATE_STEP
