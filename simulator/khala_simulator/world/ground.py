"""The ground of one game: which cells its structures block now.

Only the cells; ``pathfinding`` finds ways over the free ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.tables.layers import Layer

if TYPE_CHECKING:
    from collections.abc import Collection

    from khala_simulator.maps.game_map import Grid, MapTerrain
    from khala_simulator.world.columns import Ints


class BuiltGround:
    """The terrain with the structures that stand on it now.

    ``surfaces`` stores what ``pathfinding`` computes for a layer and the structures left out; it is empty after every
    change.
    """

    def __init__(self, terrain: MapTerrain) -> None:
        self.terrain = terrain
        self.walk: Grid = terrain.walk  # (h, w) free for a ground unit's centre now
        self.blocked: dict[int, Ints] = {}  # slot -> (k, 2) cells (x, y) of its structure
        self.surfaces: dict[tuple[Layer, tuple[int, ...]], object] = {}
        self.grids: list[object | None] = [None] * len(Layer)  # the cells of every layer as the rules read them

    def block(self, slot: int, cells: Ints) -> None:
        """Put a structure's cells ``(x, y)`` (k, 2) on the ground; cells off the map are left out."""
        if not len(cells):
            return
        height, width = self.terrain.walk.shape
        inside = (cells >= 0).all(axis=1) & (cells[:, 0] < width) & (cells[:, 1] < height)
        if inside.any():
            self.blocked[slot] = cells[inside]
            self._forget_surfaces()

    def unblock(self, slot: int) -> None:
        """Take the structure of a slot away, if it has one."""
        if self.blocked.pop(slot, None) is not None:
            self._forget_surfaces()

    def with_structures(self, grid: Grid, without: Collection[int] = ()) -> Grid:
        """Return a copy of a grid of free cells (h, w) with the cells taken of all structures but some (slots)."""
        grid = grid.copy()
        for slot, cells in self.blocked.items():
            if slot not in without:
                grid[cells[:, 1], cells[:, 0]] = False
        return grid

    def _forget_surfaces(self) -> None:
        self.walk = self.with_structures(self.terrain.walk)
        self.surfaces = {}
        self.grids = [None] * len(self.grids)
