"""The ground on a client's image: terrain, creep, fog and the lines between cells.

The terrain is painted in tiles when they are first seen, and shared by all games on the map; a view is a part of them.
Above: `scene.py`, `overview.py`. Below: `terrain.py`.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

from khala_simulator.api.painting import palette
from khala_simulator.api.painting.terrain import Cells, blend, paint_block

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.projection import Rect
    from khala_simulator.maps.game_map import MapTerrain
    from khala_simulator.world.world import World

    Image = NDArray[np.uint8]
    Mask = NDArray[np.bool_]

TILE = 16
"""Cells along a tile."""
FINEST, COARSEST = 16, 4
"""Pixels per cell with which tiles are painted."""
CREEP_OPACITY, GRID_OPACITY = 0.5, 0.07
DARK = 32
"""On ground darker than this only the lines between cells would be visible."""
MOST_STEP = 1.5
"""From this many pixels of the tiles per pixel on, they are shrunk first, so that no detail falls in between."""
_LIGHT = np.array([0, 105, 255, 0], np.uint8)
"""Brightness of ground that was never seen, was seen before, is seen, is hidden."""


class PaintedGround:
    """The ground on one of a client's images; painted again only when the view moves or creep spreads."""

    def __init__(self, columns: int, rows: int, pixels_per_cell: float, *, grid: bool = False) -> None:
        self._size = columns, rows
        self._density = min(max(math.ceil(pixels_per_cell), COARSEST), FINEST)
        self._grid = grid
        self._view: Rect | None = None
        self._creep: Mask | None = None
        self._bare: Image = np.zeros((rows, columns, 3), np.uint8)
        self._covered = self._bare

    def paint(self, world: World, player: int, view: Rect, *, fog: bool) -> Image:
        """Return a new image of this part of the map; with `fog` dark where the player does not see."""
        height = world.map.terrain.size[1]
        creep = world.creep
        if view != self._view:
            self._bare = self._cut(world.map.terrain, view)
            self._view = view
            self._creep = None
        if creep is not self._creep:
            self._covered = self._cover(creep, view)
            self._creep = creep
        if not fog:
            return self._covered.copy()
        light = cut(_LIGHT[world.visibility[player, ::-1]], (0, height), 1, view, self._size)
        shade = cv2.cvtColor(light, cv2.COLOR_GRAY2RGB)
        return np.asarray(cv2.multiply(self._covered, shade, scale=1 / 255), np.uint8)

    def _cut(self, terrain: MapTerrain, view: Rect) -> Image:
        tiles = _tiles(terrain, view)
        if tiles is None:
            return np.zeros((self._size[1], self._size[0], 3), np.uint8)
        corner = (tiles.x0 * TILE, tiles.y1 * TILE)
        image = cut(_mosaic(terrain, tiles, self._density), corner, self._density, view, self._size)
        if self._grid:
            colour = image.astype(np.float32)
            blend(colour, palette.GRID, GRID_OPACITY * (_lines(view, self._size) & (image.max(axis=2) > DARK)))
            image = colour.astype(np.uint8)
        return image

    def _cover(self, creep: Mask, view: Rect) -> Image:
        """Return the bare ground with creep on it."""
        if not creep.any():
            return self._bare
        mask = cut(creep[::-1].astype(np.uint8) * 255, (0, creep.shape[0]), 1, view, self._size) > 127
        violet = np.array(palette.CREEP, np.float32) * CREEP_OPACITY
        image = self._bare.copy()
        image[mask] = (image[mask] * (1 - CREEP_OPACITY) + violet).astype(np.uint8)
        return image


def _tiles(terrain: MapTerrain, view: Rect) -> Cells | None:
    """Return the tiles of the map that a view overlaps, counted in tiles; None if it overlaps none."""
    columns, rows = (math.ceil(cells / TILE) for cells in terrain.size)
    x0, y0 = max(0, math.floor(view.x0 / TILE)), max(0, math.floor(view.y0 / TILE))
    x1, y1 = min(columns, math.ceil(view.x1 / TILE)), min(rows, math.ceil(view.y1 / TILE))
    return Cells(x0, y0, x1, y1) if x0 < x1 and y0 < y1 else None


def _mosaic(terrain: MapTerrain, tiles: Cells, density: int) -> Image:
    """Return tiles side by side as one image."""
    rows = [
        np.concatenate([_tile(terrain, x, y, density) for x in range(tiles.x0, tiles.x1)], axis=1)
        for y in range(tiles.y1 - 1, tiles.y0 - 1, -1)
    ]
    return np.concatenate(rows, axis=0)


@functools.lru_cache(maxsize=128)
def _tile(terrain: MapTerrain, x: int, y: int, density: int) -> Image:
    image = paint_block(terrain, Cells(x * TILE, y * TILE, (x + 1) * TILE, (y + 1) * TILE), density)
    image.setflags(write=False)
    return image


def _lines(view: Rect, size: tuple[int, int]) -> Mask:
    """Return the pixels on a border between cells."""
    x = np.floor(np.linspace(view.x0, view.x1, size[0] + 1))
    y = np.floor(np.linspace(view.y1, view.y0, size[1] + 1))
    result: Mask = (np.diff(x) > 0)[None, :] | (np.diff(y) < 0)[:, None]
    return result


def cut(
    image: NDArray[np.uint8], corner: tuple[float, float], density: float, view: Rect, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """Return the part of an image that a view shows, `size` (columns, rows); black where the image ends.

    `corner` is the world point at the image's upper left, `density` its pixels per cell.
    """
    across = down = density
    step = (view.x1 - view.x0) / size[0] * density
    if step > MOST_STEP:
        rows, columns = max(1, round(image.shape[0] / step)), max(1, round(image.shape[1] / step))
        across, down = density * columns / image.shape[1], density * rows / image.shape[0]
        image = np.asarray(cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
    step_x, step_y = (view.x1 - view.x0) / size[0] * across, (view.y1 - view.y0) / size[1] * down
    left, top = (view.x0 - corner[0]) * across, (corner[1] - view.y1) * down
    inverse = np.array([[step_x, 0, left + step_x / 2 - 0.5], [0, step_y, top + step_y / 2 - 0.5]], np.float32)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(image, inverse, size, flags=flags, borderMode=cv2.BORDER_CONSTANT), np.uint8)
