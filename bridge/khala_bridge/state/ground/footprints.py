"""Footprints: which cells of the ground something stands on, and what a structure asks of the ground under it.

A typed reading of `bridge/khala_bridge/data/footprints.yaml` and `bridge/khala_bridge/data/sites.yaml`. Cells are those
of the world: cell (x, y) is the square from x to x + 1 and from y to y + 1. Whether a place is free is told by
`khala_bridge.state.ground.land`.
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
"""Where the middle of an add-on is, from that of its structure."""


class Footprint(Frozen):
    """The cells that something stands on, around its middle."""

    rows: tuple[str, ...]
    """Northernmost first: `x` stands there, `o` keeps town halls away."""
    units: tuple[str, ...]
    flat: bool = False
    """Whether units walk over it."""

    @functools.cached_property
    def cells(self) -> Cells:
        """(dx, dy) of every cell that it stands on, from the cell that `cell` gives."""
        return self._marked("x")

    @functools.cached_property
    def near(self) -> Cells:
        """(dx, dy) of every cell on which no town hall may stand, its own cells included."""
        return self._marked("xo")

    @functools.cached_property
    def size(self) -> tuple[int, int]:
        """Width and height of the mask in cells."""
        return len(self.rows[0]), len(self.rows)

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the cell from which `cells` are counted when its middle is as near to a point as the grid allows."""
        width, height = self.size
        return _nearest(x - (width % 2) / 2), _nearest(y - (height % 2) / 2)

    def middle(self, cell: tuple[int, int]) -> WorldPoint:
        """Return where its middle is when its `cells` are counted from a cell."""
        width, height = self.size
        return WorldPoint(cell[0] + (width % 2) / 2, cell[1] + (height % 2) / 2)

    def _marked(self, marks: str) -> Cells:
        width, height = self.size
        return tuple(
            (column - width // 2, height - 1 - row - height // 2)
            for row, line in enumerate(self.rows)
            for column, mark in enumerate(line)
            if mark in marks
        )


class Site(Frozen):
    """What a structure asks of the ground that it is placed on."""

    ground: Literal["bare", "powered", "creep", "any", "geyser"]
    clear: bool = False
    """Whether it keeps its distance from resources."""
    seen: bool = False
    """Whether every cell has to be in sight when it is placed."""
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
    """Return what every structure that a worker builds asks of its ground, by the structure's name."""
    return data.table("sites.yaml", Site)


@functools.cache
def _of_name() -> dict[str, tuple[str, Footprint]]:
    return {unit: (name, footprint) for name, footprint in footprints().items() for unit in footprint.units}


def footprint_of(unit: str) -> Footprint | None:
    """Return what a type of unit stands on; None for one that takes no ground."""
    found = _of_name().get(unit)
    return found and found[1]


@functools.lru_cache(1024)
def stands_on(unit_type: int) -> tuple[str, Footprint] | None:
    """Return name of the footprint of a type, given by its number, and the footprint; None for one that takes no ground."""
    return _of_name().get(unit_name(unit_type))
