"""A picture while it is drawn: a square of the world inside margins with the labels of the axes.

The frame of a canvas is that of the actions: `[x, y]` from 0 to `extent`, x to the right, y downwards; the margins end
at the point (0, 0). `pixel` alone converts points to pixels.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from khala_bridge.observe.image import palette
from khala_bridge.observe.image.lettering import written

if TYPE_CHECKING:
    from khala_bridge.observe.image.lettering import Image
    from khala_bridge.observe.image.palette import Colour

CELLS = 8
"""Cells of the grid on each axis, nine lines: 3 by 3 world units on a screen, 8 by 8 cells on a minimap."""
_GRID_SHARE = 0.16
"""Opacity of grid lines."""


SMALL_PX = 320
"""Pictures below this size get smaller labels."""


def margin_of(size_px: int, extent: float) -> int:
    """Return the width in pixels of the margins of a picture of this size, on the left and at the top."""
    digits = len(f"{extent:g}")
    return 4 + 5 * digits if size_px < SMALL_PX else 6 + 7 * digits


def inner_px(size_px: int, extent: float) -> int:
    """Return the size in pixels of the frame itself in a picture of this size."""
    return size_px - margin_of(size_px, extent)


@dataclass(frozen=True, eq=False)
class Canvas:
    """An image with a frame."""

    image: Image
    """(size, size, 3), margins included."""
    inner: Image
    """The part of the image that shows the frame; drawing on it never touches the margins."""
    scale: float
    """Pixels of a cell of the frame."""

    @classmethod
    def on(cls, ground: Image, size_px: int, extent: float) -> Canvas:
        """Return a canvas with a ground of `inner_px` pixels on both axes.

        Args:
            ground: the image under everything.
            size_px: of the whole picture on both axes.
            extent: size of the frame on both axes, in its own cells.
        """
        margin = margin_of(size_px, extent)
        image = _blank(size_px, extent).copy()
        inner = image[margin:, margin:]
        inner[:] = ground
        return cls(image, inner, (size_px - margin) / extent)

    def pixel(self, x: float, y: float) -> tuple[int, int]:
        """Return the column and row, in `inner`, of a point of the frame."""
        return round(x * self.scale - 0.5), round(y * self.scale - 0.5)

    def rule(self) -> None:
        """Draw the grid lines."""
        size = self.inner.shape[0]
        for k in range(1, CELLS):
            at = round(k * size / CELLS)
            for line in (self.inner[at : at + 1, :], self.inner[:, at : at + 1]):
                line[:] = cv2.addWeighted(line, 1 - _GRID_SHARE, np.full_like(line, palette.LINE), _GRID_SHARE, 0)


@functools.lru_cache(32)
def _blank(size_px: int, extent: float) -> Image:
    """Return an empty canvas with the labels of its axes."""
    image = np.full((size_px, size_px, 3), palette.VOID, np.uint8)
    margin = margin_of(size_px, extent)
    height = 7 if size_px < SMALL_PX else 9
    for k in range(CELLS + 1):
        value = f"{k * extent / CELLS:g}"
        at = margin + round(k * (size_px - margin) / CELLS)
        _label(image, value, height, at, margin, horizontal=True)
        _label(image, value, height, at, margin, horizontal=False)
    return image


def _label(image: Image, text: str, height: int, at: int, margin: int, *, horizontal: bool) -> None:
    """Write a number beside an axis, with a tick; the first and the last one are pushed inside."""
    size = image.shape[0]
    stamp = written(text, height, palette.LABEL)
    width, high = stamp.size
    tick: Colour = palette.mix(palette.LABEL, palette.VOID, 0.4)
    line = min(at, size - 1)
    if horizontal:
        stamp.press(image, min(max(at - width // 2, 0), size - width), (margin - 3 - high) // 2)
        image[margin - 3 : margin, line] = tick
    elif at > margin:  # the zero of both axes is one
        stamp.press(image, (margin - 2 - width) // 2, min(at - high // 2, size - high))
        image[line, margin - 3 : margin] = tick
