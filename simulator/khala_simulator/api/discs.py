"""Filled discs on the feature layers: at each pixel a layer shows a value of the topmost disc.

They are drawn into the message itself, and only what was drawn before is cleared. Nothing here knows what a unit or a
player is. Above: `layers.py`. Below: `raster.py`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.native import memory

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.raster import RasterLayer
    from khala_simulator.api.wire import Part
    from khala_simulator.native.memory import Cells

    Floats = NDArray[np.float64]

SLACK: Final = 1e-6
"""Pixels beside the edge of a disc for which nothing is decided without the root, as it is rounded."""


class DiscLayers:
    """Layers that show values of discs, the later of two discs at one pixel; a pair of them may show their density."""

    def __init__(
        self,
        layers: list[tuple[int, RasterLayer]],
        density: tuple[RasterLayer, RasterLayer] | None,
        columns: int,
        rows: int,
    ) -> None:
        """Show in each layer the values of a row, in the pair how many discs there are and 16 x what they cover."""
        area = columns * rows
        shown = [layer for _, layer in layers]
        heads = [layer.blank[0] for layer in (*shown, *(density or ()))]
        blanks = [layer.blank[1] for layer in (*shown, *(density or ()))]
        sizes = [len(part) for pair in zip(heads, blanks, strict=True) for part in pair]
        self._arrays = (
            np.frombuffer(b"".join(part for pair in zip(heads, blanks, strict=True) for part in pair), np.uint8).copy(),
            np.cumsum(sizes, dtype=np.int64)[::2].copy(),
            np.array([layer.bits_per_pixel for layer in shown], np.int64),
            np.array([row for row, _ in layers], np.int64),
            memory.new_bools(len(layers)),
            memory.new_int32s(area),
            memory.new_int32s(area),
            np.zeros(area),
            memory.new_int32s(area),
        )
        self._columns = columns
        self._rows = rows
        self._shown = len(layers)
        self._dense = density is not None
        self._message = memory.uint8s(self._arrays[0])  # all layers as fields, one after the other
        self._image = memory.ints(self._arrays[1])  # where the pixels of each layer begin in it, the pair's too
        self._bits = memory.ints(self._arrays[2])  # for a pixel of each layer
        self._value_of = memory.ints(self._arrays[3])  # row of the values for each
        self._used = memory.bools(self._arrays[4])  # whether each has a pixel that is not 0
        self._top = memory.int32s(self._arrays[5])  # topmost disc of each pixel, from 1, or 0
        self._discs = memory.int32s(self._arrays[6])  # how many cover it
        self._covered = memory.floats(self._arrays[7])  # 16 x the area that they cover
        self._pixels = memory.int32s(self._arrays[8])  # those that were drawn, in any order
        self._drawn = 0

    def encode(self, x: Floats, y: Floats, radius: Floats, values: NDArray[np.int32]) -> list[Part]:
        """Return the fields of all layers, for centres and radii [n] in pixels and values [rows, n].

        They change with the next call.
        """
        if values.dtype != np.int32 or not values.flags.c_contiguous:
            raise ValueError("the values of discs are a contiguous array of int32")
        n = values.shape[1]
        for column in (x, y, radius):
            if column.dtype != np.float64 or not column.flags.c_contiguous or len(column) != n:
                raise ValueError("the centres and radii of discs are contiguous arrays of float64, one for each value")
        value = memory.int32s(values)
        centre_x = memory.floats(x)
        centre_y = memory.floats(y)
        radii = memory.floats(radius)
        self._clear()
        for disc in range(n):
            self._draw(disc, centre_x[disc], centre_y[disc], radii[disc])
        for k in range(self._shown):
            self._fill(k, value, self._value_of[k] * n, n)
        if self._dense:
            self._fill_density()
        return [self._arrays[0].data]

    def _clear(self) -> None:
        """Make every layer blank."""
        for k in range(self._shown):
            if self._used[k]:
                self._used[k] = False
                self._blank(k)
        for i in range(self._drawn):
            pixel = self._pixels[i]
            self._top[pixel] = 0
            self._discs[pixel] = 0
            self._covered[pixel] = 0.0
            if self._dense:
                self._message[self._image[self._shown] + pixel] = 0
                self._message[self._image[self._shown + 1] + pixel] = 0
        self._drawn = 0

    def _blank(self, k: int) -> None:
        """Make one layer blank."""
        message = self._message
        image = self._image[k]
        bits = self._bits[k]
        for i in range(self._drawn):
            pixel = self._pixels[i]
            if bits == 1:
                message[image + (pixel >> 3)] = 0
            elif bits == 8:
                message[image + pixel] = 0
            else:
                at = image + 4 * pixel
                message[at] = 0
                message[at + 1] = 0
                message[at + 2] = 0
                message[at + 3] = 0

    def _draw(self, disc: int, x: float, y: float, radius: float) -> None:
        """Find the pixels of a disc: those whose centre is in it, and the one in which its own is."""
        reach = math.ceil(radius + 0.5)
        if not (-reach <= x < self._columns + reach and -reach <= y < self._rows + reach):
            return
        far = (radius + 0.5 + SLACK) * (radius + 0.5 + SLACK)
        close = max(radius - 0.5 - SLACK, 0.0) * max(radius - 0.5 - SLACK, 0.0)
        around = int(reach)
        middle_column = int(math.floor(x))  # noqa: RUF046  # in C it is no integer yet
        middle_row = int(math.floor(y))  # noqa: RUF046  # see above
        for row in range(max(middle_row - around, 0), min(middle_row + around + 1, self._rows)):
            dy = row + 0.5 - y
            for column in range(max(middle_column - around, 0), min(middle_column + around + 1, self._columns)):
                dx = column + 0.5 - x
                squared = dx * dx + dy * dy
                inside = column == middle_column and row == middle_row
                if squared > far and not inside:
                    continue
                cover = 1.0
                if squared < close:
                    inside = True
                else:  # at the edge, where a pixel is covered in part
                    distance = math.sqrt(squared)
                    cover = min(max(radius - distance + 0.5, 0.0), 1.0)
                    inside = inside or distance <= radius
                    if not (inside or cover > 0.0):
                        continue
                self._touch(row * self._columns + column, disc, inside, cover)

    def _touch(self, pixel: int, disc: int, inside: bool, cover: float) -> None:
        """Note that a disc covers a part of a pixel, and whether the pixel shows it."""
        if self._top[pixel] == 0 and self._discs[pixel] == 0 and self._covered[pixel] == 0.0:
            self._pixels[self._drawn] = pixel
            self._drawn += 1
        self._covered[pixel] += cover * 16
        if inside:
            self._top[pixel] = disc + 1
            self._discs[pixel] += 1

    def _fill(self, k: int, values: Cells, first: int, n: int) -> None:
        """Write one layer: the value of the topmost disc at each pixel."""
        message = self._message
        image = self._image[k]
        bits = self._bits[k]
        for i in range(first, first + n):
            if values[i]:
                self._used[k] = True
                break
        if not self._used[k]:
            return
        for i in range(self._drawn):
            pixel = self._pixels[i]
            disc = self._top[pixel]
            if not disc:
                continue
            value = values[first + disc - 1]
            if not value:
                continue
            if bits == 1:
                at = image + (pixel >> 3)
                message[at] = message[at] | 0x80 >> (pixel & 7)
            elif bits == 8:
                message[image + pixel] = value & 0xFF
            else:
                at = image + 4 * pixel
                message[at] = value & 0xFF
                message[at + 1] = value >> 8 & 0xFF
                message[at + 2] = value >> 16 & 0xFF
                message[at + 3] = value >> 24 & 0xFF

    def _fill_density(self) -> None:
        """Write how many discs are at each pixel, and how much of it they cover."""
        for i in range(self._drawn):
            pixel = self._pixels[i]
            smooth = int(min(self._covered[pixel], 255.0))
            self._message[self._image[self._shown] + pixel] = min(self._discs[pixel], 255)
            self._message[self._image[self._shown + 1] + pixel] = smooth
