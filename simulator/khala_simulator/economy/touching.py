"""Touching: how near workers come to their resource or town hall.

Edges touch at the radius that clients see; before a corner of the walls that stands farther out, at the walls.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.native import columns, memory
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.columns import Floats
    from khala_simulator.world.world import World

HARVEST_GAP: Final = MECHANICS.harvest_gap
LEAST: Final = 1e-9  # instead of a distance of zero


@lru_cache(maxsize=4)
def outlines(catalog: Catalog) -> Floats:
    """Return (rows, 4) of each type: half its footprint's width and height, |x| + |y| at its corners, its radius."""
    return np.array([_outline(catalog, unit) for unit in catalog.units], dtype=np.float64)


def _outline(catalog: Catalog, unit: UnitType) -> tuple[float, float, float, float]:
    footprint = catalog.footprints.get(unit.footprint)
    if footprint is None or not footprint.cells:
        return unit.radius, unit.radius, unit.radius * 2.0, unit.radius_shown
    width, height = footprint.size
    corner = max(dx + dy + 2 for dx, dy in footprint.cells)
    odd = (width % 2 + height % 2) / 2.0
    return width / 2.0, height / 2.0, corner - odd, unit.radius_shown


def distance_in(world: World, slot: int, place: int) -> float:
    """Return the distance between centres at which a worker touches a place from where it is."""
    table = outlines(world.catalog)
    return distance(columns.columns_of(world), memory.floats(table), slot, place)


def distance(c: Columns, table: Cells, slot: int, place: int) -> float:
    """Return the distance between centres at which a worker touches a place; ``table`` has the outlines."""
    row = 4 * c.type[place]
    x = c.pos[place].x - c.pos[slot].x
    y = c.pos[place].y - c.pos[slot].y
    apart = max(memory.length(x, y), LEAST)
    across = max(abs(x) / apart, LEAST)
    along = max(abs(y) / apart, LEAST)
    walls = min(table[row] / across, table[row + 1] / along, table[row + 2] / (across + along))
    touch: float = max(walls + HARVEST_GAP, table[row + 3]) + c.radius[slot]
    return touch
