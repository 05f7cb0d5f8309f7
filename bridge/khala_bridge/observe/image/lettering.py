"""Letters and stamps: small images with soft edges, made once and pressed on many pictures.

Nothing here knows the meaning of a text. Sizes are in pixels.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from khala_bridge.observe.image.palette import Colour

Image: TypeAlias = NDArray[np.uint8]
"""(height, width, 3), blue, green, red."""
Mask: TypeAlias = NDArray[np.uint8]
"""(height, width)."""

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_FINER = 4
"""Factor by which letters are drawn larger than they are shown."""


@dataclass(frozen=True, slots=True)
class Stamp:
    """A small image that is pressed on another one: `paint + image * keep / 255`."""

    paint: Image
    keep: Image
    """255 where nothing is painted; three equal channels, which OpenCV multiplies ten times as fast as one."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        return self.paint.shape[1], self.paint.shape[0]

    def press(self, image: Image, left: int, top: int) -> None:
        """Press it on an image, its corner at this pixel; parts outside of the image are cut off."""
        height, width = self.paint.shape[:2]
        x0, y0 = max(left, 0), max(top, 0)
        x1, y1 = min(left + width, image.shape[1]), min(top + height, image.shape[0])
        if x0 >= x1 or y0 >= y1:
            return
        paint, keep = self.paint, self.keep
        if (x1 - x0, y1 - y0) != (width, height):
            part = np.s_[y0 - top : y1 - top, x0 - left : x1 - left]
            paint, keep = paint[part], keep[part]
        under = image[y0:y1, x0:x1]
        cv2.multiply(under, keep, dst=under, scale=1 / 255)
        cv2.add(under, paint, dst=under)


def stamp_of(colours: Image, opacity: Mask) -> Stamp:
    """Return a stamp of an image with this opacity, 0 to 255 for each pixel."""
    alpha = cv2.merge([opacity] * 3)
    paint = cv2.multiply(colours, alpha, scale=1 / 255)
    return Stamp(np.asarray(paint, np.uint8), np.asarray(255 - alpha, np.uint8))


@functools.lru_cache(4096)
def written(text: str, height_px: int, colour: Colour, halo: Colour | None = None) -> Stamp:
    """Return a text in capitals of this height, with a dark edge of one pixel if `halo` is given."""
    mask = _mask(text, height_px)
    if halo is None:
        return stamp_of(np.full((*mask.shape, 3), colour, np.uint8), mask)
    around = cv2.dilate(mask, np.ones((3, 3), np.uint8))
    share = cv2.merge([mask] * 3).astype(np.float32) / 255
    colours = np.array(colour, np.float32) * share + np.array(halo, np.float32) * (1 - share)
    return stamp_of(colours.astype(np.uint8), np.asarray(around, np.uint8))


def _mask(text: str, height_px: int) -> Mask:
    """Return the letters in white with a free pixel around them."""
    scale = height_px * _FINER / _CAPITALS
    thickness = max(1, round(0.16 * height_px * _FINER))
    (width, height), _ = cv2.getTextSize(text, _FONT, scale, thickness)
    pad = 4 * _FINER
    large = np.zeros((height + 2 * pad, width + 2 * pad), np.uint8)
    cv2.putText(large, text, (pad, pad + height), _FONT, scale, 255, thickness, cv2.LINE_AA)
    x, y, width, height = cv2.boundingRect(large)
    if not width:
        return np.zeros((height_px + 2, 2), np.uint8)
    wide, high = max(1, round(width / _FINER)), max(1, round(height / _FINER))
    small = cv2.resize(large[y : y + height, x : x + width], (wide, high), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.copyMakeBorder(small, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0), np.uint8)


def _capital_height() -> float:
    probe = np.zeros((200, 200), np.uint8)
    cv2.putText(probe, "H", (40, 150), _FONT, 4.0, 255, 1)
    return float(cv2.boundingRect(probe)[3]) / 4.0


_CAPITALS = _capital_height()
"""Height of a capital at scale 1: OpenCV 5 draws other fonts under the old names than OpenCV 4."""
