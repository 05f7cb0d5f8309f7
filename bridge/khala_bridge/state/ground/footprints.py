"""Footprints: the cells of the ground that a thing stands on, and a structure's demands on the ground under it.

A typed reading of `bridge/khala_bridge/data/footprints.yaml` and `bridge/khala_bridge/data/sites.yaml`. Cells are those
of the world: cell (x, y) is the square from x to x + 1 and from y to y + 1. `khala_bridge.state.ground.land` knows
which places are free.
"""

from __future__ import annotations

import functools
import math
from typing import Literal

from khala_bridge import data
from khala_bridge.frames import WorldPoint
from khala_bridge.names import unit_name
from khala_protocol.messages import Frozen

Cells = tuple[tuple[int, int], ...]
ADDON: Cells = ((2, -1), (3, -1), (2, 0), (3, 0))
"""Cells of an add-on, from the middle cell of the structure that it belongs to."""
ADDON_OFFSET = (2.5, -0.5)
"""Offset of the middle of an add-on from that of its structure."""


class Footprint(Frozen):
    """The cells that a thing stands on, around its middle."""

    rows: tuple[str, ...]
    """Northernmost first: `x` is occupied, `o` keeps town halls away."""
    units: tuple[str, ...]
    flat: bool = False
    """Whether units can walk over it."""

    @functools.cached_property
    def cells(self) -> Cells:
        """(dx, dy) of every cell that it stands on, from the cell that `cell` returns."""
        return self._cells_of("x")

    @functools.cached_property
    def near(self) -> Cells:
        """(dx, dy) of every cell on which no town hall may stand, its own cells included."""
        return self._cells_of("xo")

    @functools.cached_property
    def size(self) -> tuple[int, int]:
        """Width and height of the mask in cells."""
        return len(self.rows[0]), len(self.rows)

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the origin of `cells` when its middle is as near to a point as the grid allows."""
        width, height = self.size
        return _nearest(x - (width % 2) / 2), _nearest(y - (height % 2) / 2)

    def middle(self, cell: tuple[int, int]) -> WorldPoint:
        """Return its middle when a cell is the origin of `cells`."""
        width, height = self.size
        return WorldPoint(cell[0] + (width % 2) / 2, cell[1] + (height % 2) / 2)

    def _cells_of(self, marks: str) -> Cells:
        width, height = self.size
        return tuple(
            (column - width // 2, height - 1 - row - height // 2)
            for row, line in enumerate(self.rows)
            for column, mark in enumerate(line)
            if mark in marks
        )


class Site(Frozen):
    """A structure's demands on the ground under it."""

    ground: Literal["bare", "powered", "creep", "any", "geyser"]
    clear: bool = False
    """Whether it keeps its distance from resources."""
    seen: bool = False
    """Whether every cell must be in sight when it is placed."""
    addon: bool = False
    """Whether it can have an add-on beside it."""


def _nearest(value: float) -> int:
    """Return the nearest whole number, the lower one of two; Python's own rounding would jump to even ones."""
    return math.ceil(value - 0.5)


@functools.cache
def footprints() -> dict[str, Footprint]:
    """Return every footprint by its name."""
    return data.table("footprints.yaml", Footprint)


@functools.cache
def sites() -> dict[str, Site]:
    """Return the demands of every structure that a worker builds, by the structure's name."""
    return data.table("sites.yaml", Site)


@functools.cache
def _of_name() -> dict[str, tuple[str, Footprint]]:
    return {unit: (name, footprint) for name, footprint in footprints().items() for unit in footprint.units}


def footprint_of(unit: str) -> Footprint | None:
    """Return the footprint of a type of unit; None for one that takes no ground."""
    found = _of_name().get(unit)
    return found and found[1]


@functools.lru_cache(1024)
def stands_on(unit_type: int) -> tuple[str, Footprint] | None:
    """Return the name of a footprint, and the footprint, of a type by its number; None for one that takes no ground."""
    return _of_name().get(unit_name(unit_type))
