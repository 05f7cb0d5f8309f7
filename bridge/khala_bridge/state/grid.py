"""Grids of the map as the game sends them: a value for each cell, 1 or 8 bits wide.

A grid stays bytes until its array is used, since most snapshots never need it. Rendered images and feature layers,
which begin at the top, are in `khala_bridge.state.pictures`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Bytes: TypeAlias = NDArray[np.uint8]


class Grid(NamedTuple):
    """One grid; `NO_GRID` stands for one that the game did not send."""

    width: int
    """Cells from west to east."""
    height: int
    """Cells from south to north."""
    bits: int
    """Bits of a cell: 1 or 8."""
    data: bytes
    """Row after row from the bottom left; the first of eight cells is the highest bit."""

    def cells(self) -> Bytes | None:
        """Return the values of the cells, (w, h), indexed `[x, y]` with y up; None for a grid that was not sent."""
        count = self.width * self.height
        if not self.data or not count:
            return None
        values = np.frombuffer(self.data, np.uint8)
        if self.bits == 1:
            values = np.unpackbits(values)
        return np.ascontiguousarray(values[:count].reshape(self.height, self.width).T)


NO_GRID = Grid(0, 0, 8, b"")
