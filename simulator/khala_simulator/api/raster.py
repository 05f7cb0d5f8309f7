"""Drawing of the feature layers: discs of units, samples of the terrain, images as bytes.

Arrays in, bytes out; nothing here knows what a unit or a player is. Above: `layers.py`.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING, Any

import numpy as np

from khala_simulator import compiled
from khala_simulator.api import wire

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.wire import Part

    Floats = NDArray[np.float64]

_AT_ONCE = 8000
"""Pixels looked at in one go: above, discs of one size at a time cost less than the idle pixels around small ones."""

_DTYPES: dict[int, np.dtype[Any]] = {
    1: np.dtype(np.bool_), 8: np.dtype(np.uint8), 24: np.dtype(np.uint8), 32: np.dtype("<i4"),
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Discs:
    """Filled discs on an image, in drawing order: the later of two entries for one pixel is on top."""

    pixels: NDArray[np.intp]  # [m] index into the flat image
    rows: NDArray[np.intp]  # [m] which disc
    density: NDArray[np.uint8]  # [columns * rows] discs that cover a pixel
    smooth: NDArray[np.uint8]  # [columns * rows] 16 x covered area, discs added up


@functools.lru_cache(maxsize=64)
def _window(reach: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    span = np.arange(-reach, reach + 1)
    dy, dx = np.meshgrid(span, span, indexing="ij")
    return dx.ravel(), dy.ravel()


def draw_discs(centres: Floats, radius: Floats, columns: int, rows: int) -> Discs:
    """Draw discs by their centres [n, 2] and radii [n], in pixels; every disc covers at least one pixel.

    A pixel belongs to a disc when its centre does. A few discs are drawn in one go, many by their size.
    """
    shape = (columns, rows)
    reach = np.ceil(radius + 0.5).astype(np.intp)
    largest = int(reach.max(initial=0))
    if len(radius) * (2 * largest + 1) ** 2 <= _AT_ONCE:
        pixels, disc, inside, cover = _draw_size(largest, np.arange(len(radius)), centres, radius, shape)
    else:
        parts = [_draw_size(int(k), np.flatnonzero(reach == k), centres, radius, shape) for k in np.unique(reach)]
        pixels, disc, inside, cover = (np.concatenate(column) for column in zip(*parts, strict=True))
        order = np.argsort(disc, kind="stable")
        pixels, disc, inside, cover = pixels[order], disc[order], inside[order], cover[order]
    area = columns * rows
    smooth = _bytes(np.bincount(pixels, weights=cover * 16, minlength=area), pixels)
    pixels, disc = pixels[inside], disc[inside]
    density = _bytes(np.bincount(pixels, minlength=area), pixels)
    return Discs(pixels, disc, density, smooth)


def _bytes(sums: NDArray[Any], pixels: NDArray[np.intp]) -> NDArray[np.uint8]:
    """Return an image of sums that are 0 except at these pixels; it converts only those, a fiftieth for ten units."""
    image = np.zeros(len(sums), np.uint8)
    image[pixels] = np.minimum(sums.take(pixels), 255)
    return image


def _draw_size(
    reach: int, disc: NDArray[np.intp], centres: Floats, radius: Floats, shape: tuple[int, int]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_], Floats]:
    dx, dy = _window(reach)
    x, y = centres[disc, 0, None], centres[disc, 1, None]
    column = np.floor(x).astype(np.intp) + dx
    row = np.floor(y).astype(np.intp) + dy
    distance = np.sqrt((column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2)  # rounds the same way everywhere, unlike hypot
    size = radius[disc, None]
    cover = np.minimum(np.maximum(size - distance + 0.5, 0), 1)
    centre = (dx == 0) & (dy == 0)
    inside = (distance <= size) | centre
    on_image = (column >= 0) & (column < shape[0]) & (row >= 0) & (row < shape[1])
    drawn = np.flatnonzero((inside | (cover > 0)) & on_image)
    pixels = row * shape[0] + column
    return pixels.take(drawn), disc.take(drawn // len(dx)), inside.take(drawn), cover.take(drawn)


class Sampler:
    """Takes the values of grids [y, x] of the map in the columns x and rows y of an image; 0 outside of the map."""

    def __init__(self, size: tuple[int, int], x: Floats, y: Floats) -> None:
        """Prepare an image with a column for each of the world's x, a row for each of its y, of a map of this size."""
        width, height = size
        column, row = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
        outside = ((row < 0) | (row >= height))[:, None] | ((column < 0) | (column >= width))[None, :]
        self._cell = np.clip(row, 0, height - 1)[:, None] * width + np.clip(column, 0, width - 1)[None, :]
        self._outside = outside if outside.any() else None

    def take(self, grid: NDArray[Any]) -> NDArray[Any]:
        """Return the image [rows, columns] of a grid."""
        image = grid.take(self._cell)
        if self._outside is not None:
            image[self._outside] = 0
        return image


class RasterLayer:
    """One image of a fixed size: turns it into an `ImageData` field, ready to be joined.

    24 bits per pixel are red, green and blue of an image [y, x, 3].
    """

    def __init__(self, field: int, bits_per_pixel: int, columns: int, rows: int) -> None:
        self.bits_per_pixel = bits_per_pixel
        self.area = columns * rows
        self._dtype = _DTYPES[bits_per_pixel]
        size = (self.area * bits_per_pixel + 7) // 8
        shape = wire.scalar(1, columns) + wire.scalar(2, rows)
        header = wire.scalar(1, bits_per_pixel) + wire.head(2, len(shape)) + shape + wire.head(3, size)
        self._head = wire.head(field, len(header) + size) + header
        self.blank: list[Part] = [self._head, bytes(size)]

    def encode(self, image: NDArray[Any]) -> list[Part]:
        """Return the field for an image, flat or [y, x]; the image must not change until it is sent."""
        packed = np.packbits(image, axis=None) if self.bits_per_pixel == 1 else np.ascontiguousarray(image, self._dtype)
        return [self._head, packed.data.cast("B")]

    def encode_pixels(self, pixels: NDArray[np.intp], values: NDArray[np.int32]) -> list[Part]:
        """Return the field for an image that is 0 except at these pixels; for one pixel the last value counts."""
        image = np.zeros(self.area, self._dtype)
        image[pixels] = values
        return self.encode(image)


class DiscLayers:
    """Layers that show values of discs: at each pixel that of the topmost one.

    `compiled.raster` does the same without an image for each layer; `disc_layers` chooses.
    """

    def __init__(
        self,
        layers: list[tuple[int, RasterLayer]],
        density: tuple[RasterLayer, RasterLayer] | None,
        columns: int,
        rows: int,
    ) -> None:
        """Show in each layer the values of a row, in the pair how many discs there are and 16 x what they cover."""
        self._layers, self._density, self._shape = layers, density, (columns, rows)

    def encode(self, x: Floats, y: Floats, radius: Floats, values: NDArray[np.int32]) -> list[Part]:
        """Return the fields of all layers, for centres and radii [n] in pixels and values [rows, n]."""
        near = _near(x, y, radius + 1, *self._shape)
        discs = draw_discs(np.stack([x[near], y[near]], axis=1), radius[near], *self._shape)
        parts: list[Part] = []
        for row, layer in self._layers:
            found = values[row, near]
            parts += layer.encode_pixels(discs.pixels, found.take(discs.rows)) if found.any() else layer.blank
        if self._density is not None:
            many, smooth = self._density
            parts += many.encode(discs.density) + smooth.encode(discs.smooth)
        return parts


def _near(x: Floats, y: Floats, margin: Floats, columns: int, rows: int) -> NDArray[np.intp]:
    return np.flatnonzero((x > -margin) & (x < columns + margin) & (y > -margin) & (y < rows + margin))


def disc_layers(
    layers: list[tuple[int, RasterLayer]], density: tuple[RasterLayer, RasterLayer] | None, columns: int, rows: int
) -> DiscLayers:
    """Return such layers, compiled where that is possible."""
    kernel = compiled.part("raster")
    made: DiscLayers = (DiscLayers if kernel is None else kernel.DiscLayers)(layers, density, columns, rows)
    return made
