"""Images of the feature layers: samples of the terrain, and images as bytes.

Arrays in, bytes out; nothing here knows what a unit or a player is. Above: `discs.py`, `layers.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from khala_simulator.api import wire

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.wire import Part

    Floats = NDArray[np.float64]

_DTYPES: dict[int, np.dtype[Any]] = {
    1: np.dtype(np.bool_), 8: np.dtype(np.uint8), 24: np.dtype(np.uint8), 32: np.dtype("<i4"),
}  # fmt: skip


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
