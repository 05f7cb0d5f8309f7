"""Where ground units can walk, and which way round."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from simulator.maps import Grid, Terrain


class Ground:
    """The terrain of one game with its structures on it."""

    def __init__(self, terrain: Terrain) -> None:
        self.terrain = terrain
        self.walk: Grid = terrain.walk.copy()  # (h, w) free for a ground unit's centre now
        self._blocked: dict[int, NDArray[np.int64]] = {}
        self.version = 0

    def block(self, slot: int, cells: NDArray[np.int64]) -> None:
        """Put a structure's cells ``(x, y)`` (k, 2) on the ground."""
        if len(cells):
            self._blocked[slot] = cells
            self._rebuild()

    def unblock(self, slot: int) -> None:
        """Take the structure of a slot away, if it has one."""
        if self._blocked.pop(slot, None) is not None:
            self._rebuild()

    def _rebuild(self) -> None:
        self.walk = self.terrain.walk.copy()
        for cells in self._blocked.values():
            self.walk[cells[:, 1], cells[:, 0]] = False
        self.version += 1
