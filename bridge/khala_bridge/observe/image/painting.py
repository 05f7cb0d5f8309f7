"""The ground of a map in colours, painted once and seen through any camera.

    painting = Painting.of(info)                 cached: a map is painted once
    painting.seen(camera, size_px, veil)         the part of it under a camera, with creep and fog of the moment

Arrays here are images: row 0 is the top of the map, (height, width). `upright` converts the grids of
`khala_bridge.state.ground`, which have their first cell at the bottom left. Units are in `moment`.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import cv2
import numpy as np

from khala_bridge.frames import CAMERA_WIDTH
from khala_bridge.observe.image import palette
from khala_bridge.state.ground import MapGround

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_bridge.frames import Camera
    from khala_bridge.observe.image.lettering import Image, Mask
    from khala_bridge.state import EpisodeInfo

T = TypeVar("T", bound=np.generic)

FINE = 10
"""Pixels of the painted ground for a world unit; a camera enlarges them."""
_PAD = 1
"""World units around a camera that are cut out with it, so that soft edges are the same as on the whole map."""
_CELLS = int(CAMERA_WIDTH) + 2 * _PAD + 1
_EXPLORED, _HIDDEN = 0.6, 0.3
"""Brightness of ground that is not in sight now, and of ground that was never seen."""
_SEEN = 2
"""The game's number for cells that are in sight."""


def upright(grid: NDArray[T]) -> NDArray[T]:
    """Return a grid with `[x, y]` from the bottom left as an image, row 0 at the top."""
    return np.ascontiguousarray(grid.T[::-1])


@dataclass(frozen=True)
class Veil:
    """Creep and fog at one moment, as images with a pixel for each cell; None if the game sent none."""

    creep: Mask | None
    sight: Mask | None
    """0 never seen, 1 not seen now, 2 seen."""


@dataclass(frozen=True, eq=False)
class Painting:
    """A map's ground."""

    width: int
    height: int
    image: Image
    """The whole map, `FINE` pixels for a world unit."""

    @classmethod
    def of(cls, info: EpisodeInfo) -> Painting:
        """Return the ground of the map that a game is played on."""
        return _painting(MapGround.of(info), info.playable)

    def seen(self, camera: Camera, size_px: int, veil: Veil) -> Image:
        """Return the part that a camera shows, (size_px, size_px, 3); off by at most half of the painting's pixels."""
        left, top, x, y = self._window(camera)
        part = _cut(self.image, left * FINE, top * FINE, _CELLS * FINE, palette.VOID)
        if veil.creep is not None:
            tint(part, _cut(veil.creep, left, top, _CELLS, 0))
        if veil.sight is not None:
            shade(part, _cut(veil.sight, left, top, _CELLS, 0))
        column = round(x * FINE)
        row = round(y * FINE)
        wide = int(CAMERA_WIDTH * FINE)
        view = part[row : row + wide, column : column + wide]
        return np.asarray(cv2.resize(view, (size_px, size_px), interpolation=cv2.INTER_LINEAR), np.uint8)

    def cells(self, values: Mask, camera: Camera, size_px: int) -> Mask:
        """Return the part of a cell image that a camera shows, values unchanged, (size_px, size_px)."""
        left, top, x, y = self._window(camera)
        part = _cut(values, left, top, _CELLS, 0)
        place = (np.arange(size_px) + 0.5) / size_px * CAMERA_WIDTH
        rows, columns = (y + place).astype(np.intp), (x + place).astype(np.intp)
        return np.ascontiguousarray(part[rows[:, None], columns[None, :]])

    def _window(self, camera: Camera) -> tuple[int, int, float, float]:
        """Return the first column and row of the cells to cut out, and the start of the camera's view in them."""
        x, y = camera.x - CAMERA_WIDTH / 2, self.height - camera.y - CAMERA_WIDTH / 2
        left, top = math.floor(x) - _PAD, math.floor(y) - _PAD
        return left, top, x - left, y - top


@functools.lru_cache(8)
def _painting(ground: MapGround, playable: tuple[int, int, int, int]) -> Painting:
    width, height = ground.size
    walkable = upright(ground.walkable)
    if not walkable.any():  # the game sent no grid
        walkable = np.ones((height, width), np.bool_)
    x0, y0, x1, y1 = playable
    inside = np.zeros((height, width), np.bool_)
    inside[max(height - y1, 0) : height - y0, x0:x1] = True
    image = _paint(upright(ground.height), walkable, walkable & ~upright(ground.buildable), inside)
    return Painting(width, height, image)


def _paint(
    heights: NDArray[np.float32], walkable: NDArray[np.bool_], unbuildable: NDArray[np.bool_], inside: NDArray[np.bool_]
) -> Image:
    """Return the ground in colours: high ground is light, unwalkable ground dark, with light from the upper left."""
    rows, columns = heights.shape
    size = (columns * FINE, rows * FINE)
    level = _smooth(_level(heights, inside & walkable), size)
    walk, ramp = _edge(_smooth(walkable, size)), _edge(_smooth(unbuildable, size))
    ground = _lerp(_flat(palette.LOW), _flat(palette.HIGH), level)
    ground = _lerp(ground, _flat(palette.RAMP), 0.28 * ramp * walk)
    ground = _lerp(_flat(palette.ROCK) + 12 * level[..., None], ground, walk)
    slope = cv2.GaussianBlur(level, (0, 0), 2)
    light = cv2.Sobel(slope, cv2.CV_32F, 1, 0, scale=0.5) + cv2.Sobel(slope, cv2.CV_32F, 0, 1, scale=0.5)
    ground += 420 * np.clip(light, -0.08, 0.08)[..., None]
    rim = np.clip(cv2.GaussianBlur(walk, (0, 0), FINE / 6) - walk, 0, 1)
    ground += 90 * rim[..., None]
    ground[::FINE] += 3
    ground[:, ::FINE] += 3
    outside = cv2.resize(inside.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) == 0
    ground[outside] = ground[outside] * 0.22 + _flat(palette.VOID) * 0.5
    return np.clip(ground, 0, 255).astype(np.uint8)


def _level(heights: NDArray[np.float32], used: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return heights from 0 to 1 over the walkable part of the map, so that deep chasms do not reduce the contrast."""
    values = heights[used] if used.any() else heights
    low, high = (float(np.percentile(values, share)) for share in (1, 99)) if values.size else (0.0, 1.0)
    if high - low < 1:  # half a cliff level: the map is flat
        return np.full(heights.shape, 0.5, np.float32)
    return np.asarray(np.clip((heights - low) / (high - low), 0, 1), np.float32)


def _smooth(values: NDArray[Any], size: tuple[int, int]) -> NDArray[np.float32]:
    """Return an image enlarged without steps."""
    large = cv2.resize(values.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
    return np.asarray(large, np.float32)


def _edge(share: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a mask with a soft border of about two pixels where a smooth mask passes one half."""
    return np.asarray(np.clip((share - 0.5) * 4 + 0.5, 0, 1), np.float32)


def _flat(colour: palette.Colour) -> NDArray[np.float32]:
    return np.array(colour, np.float32)


def _lerp(one: NDArray[np.float32], other: NDArray[np.float32], part: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(one + (other - one) * part[..., None], np.float32)


def _cut(image: NDArray[np.uint8], left: int, top: int, size: int, outside: Any) -> NDArray[np.uint8]:
    """Return a square part of an image, padded beyond its edges."""
    height, width = image.shape[:2]
    x0, y0 = min(max(left, 0), width), min(max(top, 0), height)
    x1, y1 = min(max(left + size, 0), width), min(max(top + size, 0), height)
    if (x1 - x0, y1 - y0) == (size, size):
        return image[y0:y1, x0:x1].copy()
    part = np.empty((size, size, *image.shape[2:]), np.uint8)
    part[:] = outside
    part[y0 - top : y1 - top, x0 - left : x1 - left] = image[y0:y1, x0:x1]
    return part


def tint(part: Image, creep: Mask) -> None:
    """Draw creep over a part of the ground."""
    if not creep.any():
        return
    share = _edge(_smooth(np.minimum(creep, 1), (part.shape[1], part.shape[0]))) * np.float32(0.62 * 255)
    alpha = cv2.merge([share.astype(np.uint8)] * 3)
    under = cv2.multiply(part, 255 - alpha, scale=1 / 255)
    over = cv2.multiply(np.full_like(part, palette.CREEP), alpha, scale=1 / 255)
    cv2.add(under, over, dst=part)


_BRIGHTNESS = np.array([_HIDDEN, _EXPLORED, 1.0, 1.0], np.float32)


def shade(part: Image, sight: Mask) -> None:
    """Darken the unseen part of the ground."""
    if sight.min() >= _SEEN:
        return
    light = _smooth(_BRIGHTNESS[np.minimum(sight, 3)] * 255, (part.shape[1], part.shape[0])).astype(np.uint8)
    cv2.multiply(part, cv2.merge([light] * 3), dst=part, scale=1 / 255)
