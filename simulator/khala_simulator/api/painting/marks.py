"""Small marks on a rendered image: bars, rings, shots, sparks. Works in pixels, on the given image.

Above: `scene.py`, `overview.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from khala_simulator.api.painting import palette

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from khala_simulator.api.painting.palette import Colour

    Image = NDArray[np.uint8]
    Point = tuple[float, float]

SHIFT = 4
"""OpenCV takes fractions of pixels as whole numbers of sixteenths."""
_PIXEL = 1 << SHIFT
BEAM_OPACITY = 0.62


def fixed_point(point: Point) -> tuple[int, int]:
    """Return a point as OpenCV takes it with `SHIFT`, where whole numbers are the middles of pixels."""
    return round((point[0] - 0.5) * _PIXEL), round((point[1] - 0.5) * _PIXEL)


def health_colour(share: float) -> Colour:
    """Return red, yellow or green."""
    return palette.HEALTH[0 if share <= 1 / 3 else 1 if share <= 2 / 3 else 2]


def bars(
    image: Image, middle: int, bottom: int, size: tuple[int, int], shares: Sequence[tuple[float, Colour]], border: int
) -> None:
    """Draw stacked bars, the first on top, on a dark ground; `bottom` is the row below them, `size` is per bar."""
    width, height = size
    rows, columns = image.shape[:2]
    left, top = middle - width // 2, bottom - height * len(shares)
    x0 = max(0, left)
    x1 = min(columns, left + width)
    if x0 >= x1 or bottom <= 0 or top >= rows:
        return
    image[max(0, top - border) : bottom + border, max(0, left - border) : x1 + border] = palette.BAR
    for share, colour in shares:
        filled = min(x1, left + max(round(width * share), 1 if share > 0 else 0))
        if filled > x0 and top + height > 0:
            image[max(0, top) : top + height, x0:filled] = colour
        top += height


def pips(image: Image, left: int, top: int, size: int, colours: Sequence[Colour]) -> None:
    """Draw small squares side by side on a dark ground."""
    rows, columns = image.shape[:2]
    width = (size + 1) * len(colours)
    if left < 1 or top < 1 or left + width >= columns or top + size >= rows:
        return
    image[top - 1 : top + size + 1, left - 1 : left + width] = palette.BAR
    for k, colour in enumerate(colours):
        x = left + k * (size + 1)
        image[top : top + size, x : x + size] = colour


def ring(image: Image, centre: Point, radius: float, colour: Colour, width: int = 1) -> None:
    """Draw a circle with soft edges."""
    cv2.circle(image, fixed_point(centre), round(radius * _PIXEL), colour, width, cv2.LINE_AA, SHIFT)


def dot(image: Image, centre: Point, radius: float, colour: Colour) -> None:
    """Draw a disc with soft edges."""
    cv2.circle(image, fixed_point(centre), round(radius * _PIXEL), colour, -1, cv2.LINE_AA, SHIFT)


def line(image: Image, start: Point, end: Point, colour: Colour, width: int = 1) -> None:
    """Draw a line with soft edges."""
    cv2.line(image, fixed_point(start), fixed_point(end), colour, width, cv2.LINE_AA, SHIFT)


def beams(image: Image, shots: Sequence[tuple[Point, Point, Colour]], width: int) -> None:
    """Draw shots from attackers to targets, the ground shining through."""
    ends = np.array([point for start, end, _ in shots for point in (start, end)])
    x0, y0 = np.maximum(ends.min(axis=0).astype(np.intp) - width, 0).tolist()
    x1, y1 = np.maximum(ends.max(axis=0).astype(np.intp) + width + 2, 0).tolist()
    region = image[y0:y1, x0:x1]
    if not region.size:
        return
    over = region.copy()
    for start, end, colour in shots:
        line(over, (start[0] - x0, start[1] - y0), (end[0] - x0, end[1] - y0), colour, width)
    cv2.addWeighted(over, BEAM_OPACITY, region, 1 - BEAM_OPACITY, 0, dst=region)


def spark(image: Image, at: Point, size: float, turn: int) -> None:
    """Draw a small cross of light where a unit is hit; `turn` varies it."""
    x, y = at
    a, b = (
        ((size, size * 0.35), (-size * 0.35, size))
        if turn % 2
        else ((size * 0.7, -size * 0.7), (size * 0.7, size * 0.7))
    )
    for dx, dy in (a, b):
        line(image, (x - dx, y - dy), (x + dx, y + dy), (255, 250, 210))


def missile(image: Image, at: Point, tail: Point, colour: Colour, size: float) -> None:
    """Draw a bright head with a short tail."""
    line(image, tail, at, colour, 1)
    dot(image, at, size, (255, 255, 255))
