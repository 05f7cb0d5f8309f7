"""Placement: where a new unit fits, as near as possible to where it is wanted.

The game's own formation around a shared point is not known; here it is the nearest free place on a fine grid of
candidates, the same every time.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from simulator.stats import LAYERS
from simulator.traits import Layer, layer_of

if TYPE_CHECKING:
    from simulator.geometry import Floats
    from simulator.records import UnitType
    from simulator.world import Bools, World

CANDIDATE_STEP = 0.25
SEARCH_RADIUS = 12.0
BODY_GAP = 0.02


def free_place(world: World, unit: UnitType, point: tuple[float, float]) -> tuple[float, float]:
    """The place nearest to ``point`` where ``unit`` touches no body and no wall; ``point`` if there is none.

    Structures are put on the cell grid, where their footprint fits it.
    """
    footprint = world.catalog.footprints.get(unit.footprint)
    if footprint is not None and footprint.cells:
        return snapped(point, footprint.size)
    at = np.array(point) + _offsets()
    free = _on_surface(world, unit, at)
    bodies = world.live
    bits = sum(1 << LAYERS.index(name) for name in unit.collide)
    bodies = bodies[(world.layer_bits[bodies] & bits) != 0]
    if bodies.size:
        apart = world.separation[bodies] + unit.separation + BODY_GAP
        for i in np.flatnonzero(free).tolist():
            offset = world.pos[bodies] - at[i]
            if (offset[:, 0] ** 2 + offset[:, 1] ** 2 >= apart**2).all():
                return float(at[i, 0]), float(at[i, 1])
        return point
    first = np.flatnonzero(free)
    return (float(at[first[0], 0]), float(at[first[0], 1])) if first.size else point


def snapped(point: tuple[float, float], size: tuple[int, int]) -> tuple[float, float]:
    """The centre nearest to ``point`` at which a footprint of ``size`` cells lies on the grid."""
    x, y = (round(v - s / 2.0) + s / 2.0 for v, s in zip(point, size, strict=True))
    return x, y


def _on_surface(world: World, unit: UnitType, at: Floats) -> Bools:
    x0, y0, x1, y1 = world.map.terrain.playable
    inside: Bools = (at[:, 0] >= x0) & (at[:, 1] >= y0) & (at[:, 0] < x1) & (at[:, 1] < y1)
    layer = layer_of(unit)
    if layer is Layer.AIR:
        return inside
    surface = world.ground.surface(layer)
    return inside & surface.flat[surface.cell(at)]


@lru_cache(maxsize=1)
def _offsets() -> Floats:
    """Candidate offsets, nearest first; equally near ones from the east counter-clockwise."""
    side = np.arange(-SEARCH_RADIUS, SEARCH_RADIUS + CANDIDATE_STEP / 2.0, CANDIDATE_STEP)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    squared = x * x + y * y
    quarter = np.where(y >= 0.0, np.where(x > 0.0, 0, 1), np.where(x < 0.0, 2, 3))
    order = np.lexsort((x, y, quarter, squared))
    order = order[squared[order] <= SEARCH_RADIUS**2]
    return np.stack([x[order], y[order]], axis=1)
