"""The ground of a map as an image: height as lightness, slopes in relief, cliffs with edges, ramps in stripes.

The whole map is painted once and shared by all games on it; a view is a cut of it. Knows no units and no player.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from simulator.api.painting import palette

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from simulator.api.projection import Rect
    from simulator.maps import Terrain
    from simulator.world import World

    Image = NDArray[np.uint8]
    Floats = NDArray[np.float32]
    Mask = NDArray[np.bool_]

MAX_BYTES = 12 << 20
"""Largest image of a whole map: a large map is painted with fewer pixels per cell."""
FINEST, COARSEST = 16, 4
LIGHT = (-0.62, 0.62)
"""Direction from which the light falls, in the world: from the upper left."""
RELIEF = 0.34
SHADE = (0.62, 1.4)
CONTOUR = 0.5
"""World units of height from one stripe of a ramp to the next."""
CREEP_OPACITY, GRID_OPACITY = 0.5, 0.07
DARK = 32
"""On ground darker than this the lines between cells would be all there is to see."""
MOST_STEP = 1.5
"""From this many pixels of the map's image per pixel on, it is shrunk first, so that no detail falls in between."""
_LIGHT = np.array([0, 105, 255, 0], np.uint8)
"""Brightness of ground that was never seen, was seen before, is seen, is hidden."""


def density_for(terrain: Terrain, pixels_per_cell: float) -> int:
    """Pixels per cell with which a map is painted to be shown at this scale."""
    width, height = terrain.size
    most = math.isqrt(MAX_BYTES // (3 * width * height))
    return max(1, min(max(math.ceil(pixels_per_cell), COARSEST), FINEST, most))


@functools.lru_cache(maxsize=4)
def paint_ground(terrain: Terrain, density: int) -> Image:
    """The whole map with `density` pixels per cell, north at the top."""
    walk = _smooth(terrain.walk, density)
    height = _heights(terrain, density)
    void = _smooth(terrain.cliff > 0, density)
    colour = _tint(terrain, height)
    colour *= _relief(height, density)[..., None]
    _blend(colour, palette.ROCK, 0.72 * ~walk)
    _hatch(colour, ~walk & void, density)
    _stripe(colour, height, _smooth(_ramps(terrain), density) & walk)
    _grain(colour, density)
    _blend(colour, palette.VOID, 0.9 * ~void)
    _edges(colour, walk, height, density)
    _blend(colour, palette.VOID, 0.55 * ~_smooth(_playable(terrain), density))
    return np.clip(colour, 0, 255).astype(np.uint8)


def _upright(grid: NDArray[Any]) -> Floats:
    return np.ascontiguousarray(grid[::-1], np.float32)


def _smooth(grid: Mask, density: int) -> Mask:
    """A mask of cells as a mask of pixels, its corners rounded by less than half a cell."""
    hard = cv2.resize(_upright(grid), None, fx=density, fy=density, interpolation=cv2.INTER_NEAREST)
    result: Mask = cv2.GaussianBlur(hard, (0, 0), density * 0.42, borderType=cv2.BORDER_REPLICATE) > 0.5
    return result


def _heights(terrain: Terrain, density: int) -> Floats:
    """Ground z of every pixel, between the corners of its cell."""
    width, height = terrain.size
    inverse = np.array([[1 / density, 0, 0.5 / density], [0, 1 / density, 0.5 / density]], np.float32)
    corners = _upright(terrain.vertices)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    size = (width * density, height * density)
    return np.asarray(cv2.warpAffine(corners, inverse, size, flags=flags, borderMode=cv2.BORDER_REPLICATE), np.float32)


def _tint(terrain: Terrain, height: Floats) -> Floats:
    """Lightness by height, over the heights at which something can stand."""
    floor = terrain.vertices[:-1, :-1][terrain.cliff > 0]
    low, high = (float(np.percentile(floor, part)) for part in (2, 98)) if floor.size else (8.0, 12.0)
    part = np.clip((height - low) / max(high - low, 4.0), -0.25, 1.0)[..., None]
    result: Floats = np.array(palette.LOW, np.float32) * (1 - part) + np.array(palette.HIGH, np.float32) * part
    return result


def _relief(height: Floats, density: int) -> Floats:
    """Light and shade of slopes, as a factor."""
    soft = cv2.GaussianBlur(height, (0, 0), density * 0.2)
    east = cv2.Sobel(soft, cv2.CV_32F, 1, 0, scale=density / 8)
    north = -cv2.Sobel(soft, cv2.CV_32F, 0, 1, scale=density / 8)
    result: Floats = np.clip(1 - RELIEF * (east * LIGHT[0] + north * LIGHT[1]), *SHADE)
    return result


def _ramps(terrain: Terrain) -> Mask:
    result: Mask = terrain.walk & (terrain.cliff % 64 != 0)
    return result


def _stripe(colour: Floats, height: Floats, ramp: Mask) -> None:
    """Ramps are sandy and striped across their slope."""
    _blend(colour, palette.RAMP, 0.45 * ramp)
    phase = np.mod(height, CONTOUR) < CONTOUR / 2
    colour *= np.where(ramp & phase, 0.86, 1.0).astype(np.float32)[..., None]


def _hatch(colour: Floats, rock: Mask, density: int) -> None:
    """Ground that nobody can walk on is hatched."""
    rows, columns = rock.shape
    line = (np.arange(rows)[:, None] + np.arange(columns)[None, :]) % max(4, density // 2 * 2) < max(1, density // 6)
    colour *= np.where(rock & line, 0.72, 1.0).astype(np.float32)[..., None]


def _grain(colour: Floats, density: int) -> None:
    """A fine texture, always the same, that keeps large areas from being flat."""
    rows, columns = colour.shape[:2]
    rng = np.random.default_rng(7)
    coarse = rng.standard_normal((rows // density * 2 + 1, columns // density * 2 + 1)).astype(np.float32)
    fine = rng.standard_normal((rows // 2 + 1, columns // 2 + 1)).astype(np.float32)
    grain = 2.2 * cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_CUBIC)
    grain += 1.4 * cv2.resize(fine, (columns, rows), interpolation=cv2.INTER_LINEAR)
    colour += grain[..., None]


def _edges(colour: Floats, walk: Mask, height: Floats, density: int) -> None:
    """A dark line where walking ends, and a bright one above it where the ground falls away."""
    size = max(1, round(density / 8)) * 2 + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    solid = walk.astype(np.uint8)
    outer = (cv2.dilate(solid, disc) > 0) & ~walk
    inner = walk & (cv2.erode(solid, disc) == 0)
    beyond = cv2.erode(height, np.ones((3 * density // 2 | 1, 3 * density // 2 | 1), np.uint8))
    _blend(colour, palette.CREST, 0.75 * (inner & (height - beyond > 0.8)))
    _blend(colour, palette.EDGE, 0.85 * outer)


def _playable(terrain: Terrain) -> Mask:
    x0, y0, x1, y1 = terrain.playable
    inside = np.zeros(terrain.walk.shape, np.bool_)
    inside[y0:y1, x0:x1] = True
    return inside


def _blend(colour: Floats, paint: palette.Colour, part: NDArray[np.floating]) -> None:
    part = part[..., None].astype(np.float32)
    colour += (np.array(paint, np.float32) - colour) * part


# views ----------------------------------------------------------------------------------------------------------------


class Ground:
    """The ground as one image of a client shows it; painted anew only when the view moves or creep spreads."""

    def __init__(self, columns: int, rows: int, pixels_per_cell: float, *, grid: bool = False) -> None:
        self._size = columns, rows
        self._per_cell = pixels_per_cell
        self._grid = grid
        self._view: Rect | None = None
        self._creep: Mask | None = None
        self._image: Image = np.zeros((rows, columns, 3), np.uint8)

    def paint(self, world: World, player: int, view: Rect, *, fog: bool) -> Image:
        """A fresh image of this part of the map; with `fog` dark where the player does not see."""
        terrain = world.map.terrain
        if view != self._view or world.creep is not self._creep:
            self._view, self._creep = view, world.creep
            self._image = self._bare(terrain, world.creep, view)
        if not fog:
            return self._image.copy()
        light = cut(_LIGHT[world.visibility[player, ::-1]], terrain.size, view, self._size)
        return np.asarray(cv2.multiply(self._image, cv2.cvtColor(light, cv2.COLOR_GRAY2RGB), scale=1 / 255), np.uint8)

    def _bare(self, terrain: Terrain, creep: Mask, view: Rect) -> Image:
        map_image = paint_ground(terrain, density_for(terrain, self._per_cell))
        image = cut(map_image, terrain.size, view, self._size).astype(np.float32)
        if creep.any():
            mask = cut(creep[::-1].astype(np.uint8) * 255, terrain.size, view, self._size)
            _blend(image, palette.CREEP, CREEP_OPACITY * (mask > 127))
        if self._grid:
            _blend(image, palette.GRID, GRID_OPACITY * (_lines(view, self._size) & (image.max(axis=2) > DARK)))
        return image.astype(np.uint8)


def _lines(view: Rect, size: tuple[int, int]) -> Mask:
    """The pixels that lie on a border between cells."""
    x = np.floor(np.linspace(view.x0, view.x1, size[0] + 1))
    y = np.floor(np.linspace(view.y1, view.y0, size[1] + 1))
    result: Mask = (np.diff(x) > 0)[None, :] | (np.diff(y) < 0)[:, None]
    return result


def cut(image: NDArray[np.uint8], cells: tuple[int, int], view: Rect, size: tuple[int, int]) -> NDArray[np.uint8]:
    """The part of a map's image that a view shows, `size` (columns, rows); black outside of the map.

    `cells` is the size of the map; the image may have any number of pixels per cell.
    """
    per_cell = image.shape[1] / cells[0]
    step_x, step_y = (view.x1 - view.x0) / size[0] * per_cell, (view.y1 - view.y0) / size[1] * per_cell
    left, top = view.x0 * per_cell, (cells[1] - view.y1) * per_cell
    if step_x > MOST_STEP:
        rows, columns = max(1, round(image.shape[0] / step_x)), max(1, round(image.shape[1] / step_x))
        small = cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
        return cut(np.asarray(small, np.uint8), cells, view, size)
    inverse = np.array([[step_x, 0, left + step_x / 2 - 0.5], [0, step_y, top + step_y / 2 - 0.5]], np.float32)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(image, inverse, size, flags=flags, borderMode=cv2.BORDER_CONSTANT), np.uint8)
