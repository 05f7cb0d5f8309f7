"""Bodies of units: one stamp for each look, with side, shape, facing, size and the letters of the type.

Ground units are discs with a nose that shows where they face, flying ones arrowheads over their shadow, structures
squares with cut corners and a dark middle; minerals are crystals, geysers rings, and other neutral things stones.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import cv2
import numpy as np

from khala_bridge.observe.image import palette
from khala_bridge.observe.image.lettering import Stamp, stamp_of, written
from khala_bridge.observe.image.palette import LIVERIES, mix

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_bridge.observe.image.lettering import Image, Mask
    from khala_bridge.observe.image.palette import Colour, Side

Shape: TypeAlias = Literal["ground", "air", "structure", "minerals", "rich", "geyser", "stone", "field"]

DIRECTIONS = 32
"""Number of directions in which a unit may face."""
_FINER = 4
_REACH = 1.5
"""Half of a stamp's size in radii: room for the nose, and for the shadow of flying units."""
LETTERS_FROM_PX = 5.5
"""Radius in pixels from which letters are readable."""
_GHOST = 0.5
"""Opacity of units that are cloaked, burrowed, not real, or only remembered."""
_UNFINISHED = 0.7
_SHADOW = 0.45
_SHIFT = 3
"""OpenCV takes fractions of pixels as integers of eighths."""
_TURNED = frozenset({"ground", "air"})
_NEUTRAL: dict[Shape, Colour] = {
    "minerals": palette.MINERALS,
    "rich": palette.RICH_MINERALS,
    "geyser": palette.VESPENE,
}

Outline: TypeAlias = tuple[tuple[float, float], ...]
"""Corners in radii; x forward, y to the left."""


def _ring(corners: int, radius: float = 1.0, turn: float = 0.0) -> Outline:
    angles = (2 * math.pi * k / corners + turn for k in range(corners))
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


_CUT = 0.62
_SQUARE: Outline = ((1, _CUT), (_CUT, 1), (-_CUT, 1), (-1, _CUT), (-1, -_CUT), (-_CUT, -1), (_CUT, -1), (1, -_CUT))
_OUTLINES: dict[Shape, Outline] = {
    "ground": (*_ring(28, 1.0, 0.42)[:25], (1.42, 0.0)),
    "air": ((1.3, 0), (-0.55, 0.98), (-0.95, 0.8), (-0.55, 0), (-0.95, -0.8), (-0.55, -0.98)),
    "structure": _SQUARE,
    "minerals": ((1.05, 0), (0.35, 0.62), (-0.5, 0.5), (-1.05, 0.1), (-0.4, -0.55), (0.45, -0.5)),
    "rich": ((1.05, 0), (0.35, 0.62), (-0.5, 0.5), (-1.05, 0.1), (-0.4, -0.55), (0.45, -0.5)),
    "geyser": _ring(28),
    "stone": _ring(7, 1.0, 0.3),
    "field": _ring(40),
}


class BodyLook(NamedTuple):
    """Everything that a stamp depends on."""

    shape: Shape
    side: Side
    radius_px: int
    direction: int
    """Of `DIRECTIONS`, counter-clockwise from the right; 0 for units that do not turn."""
    code: str
    ghost: bool
    unfinished: bool


def direction_of(facing: float, shape: Shape) -> int:
    """Return the nearest direction to an angle in radians."""
    return round(facing / (2 * math.pi) * DIRECTIONS) % DIRECTIONS if shape in _TURNED else 0


@functools.lru_cache(2048)
def body(look: BodyLook) -> Stamp:
    """Return the stamp of a look; the unit is in its middle."""
    half = math.ceil(look.radius_px * _REACH) + 3
    size = 2 * half + 1
    colours = np.zeros((size * _FINER, size * _FINER, 3), np.uint8)
    opacity = np.zeros(colours.shape[:2], np.uint8)
    if look.shape == "field":
        _draw_field(colours, opacity, look)
    else:
        _draw_solid(colours, opacity, look)
    small = np.asarray(cv2.resize(colours, (size, size), interpolation=cv2.INTER_AREA), np.uint8)
    alpha = np.asarray(cv2.resize(opacity, (size, size), interpolation=cv2.INTER_AREA), np.uint8)
    covered = np.where(opacity, np.uint8(255), np.uint8(0))
    cover = np.asarray(cv2.resize(covered, (size, size), interpolation=cv2.INTER_AREA), np.uint8)
    share = _GHOST if look.ghost else _UNFINISHED if look.unfinished else 1.0
    stamp = stamp_of(_remove_fringe(small, cover), np.asarray(alpha * share, np.uint8))
    return _add_letters(stamp, look, half) if look.code else stamp


def _draw_solid(colours: Image, opacity: Mask, look: BodyLook) -> None:
    livery = LIVERIES[look.side]
    fill = _NEUTRAL.get(look.shape, livery.body)
    rim = mix(fill, (0, 0, 0), 0.6) if look.side == "neutral" else livery.rim
    width = max(1.4, 0.12 * look.radius_px)
    outline = _corners(look, 1.0 - width / look.radius_px)  # the rim ends where the body does
    if look.shape == "air":  # its shadow lies below it, to the right
        shift = np.int32(round(0.22 * look.radius_px * _FINER) << _SHIFT)
        _fill(colours, opacity, outline + shift, palette.INK, round(255 * _SHADOW))
    _fill(colours, opacity, outline, palette.INK, 255, grow_px=width + 1)
    _fill(colours, opacity, outline, rim, 255, grow_px=width)
    _fill(colours, opacity, outline, fill, 255)
    if look.shape == "structure":
        _fill(colours, opacity, _corners(look, 0.66), mix(fill, (0, 0, 0), 0.42), 255)
    if look.shape == "geyser":
        _fill(colours, opacity, _corners(look, 0.55), mix(fill, (0, 0, 0), 0.5), 255)


def _draw_field(colours: Image, opacity: Mask, look: BodyLook) -> None:
    """Draw a force field, which is transparent."""
    outline = _corners(look, 1.0)
    _fill(colours, opacity, outline, (255, 214, 170), 235, grow_px=1.5)
    _fill(colours, opacity, outline, (220, 140, 60), 150)


def _corners(look: BodyLook, scale: float) -> NDArray[np.int32]:
    """Return the outline of a look in fractions of the fine image's pixels."""
    angle = 2 * math.pi * look.direction / DIRECTIONS
    forward, left = np.array(_OUTLINES[look.shape]).T * look.radius_px * scale * _FINER
    middle = ((math.ceil(look.radius_px * _REACH) + 3) * 2 + 1) * _FINER / 2 - 0.5
    x = middle + forward * math.cos(angle) - left * math.sin(angle)
    y = middle - forward * math.sin(angle) - left * math.cos(angle)
    return np.asarray(np.rint(np.stack([x, y], axis=1) * (1 << _SHIFT)), np.int32)


def _fill(
    colours: Image, opacity: Mask, outline: NDArray[np.int32], colour: Colour, alpha: int, grow_px: float = 0.0
) -> None:
    """Fill an outline, wider by a number of pixels of the finished stamp."""
    for image, value in ((colours, colour), (opacity, (alpha, alpha, alpha))):
        cv2.fillPoly(image, [outline], value, cv2.LINE_8, _SHIFT)
        if grow_px:
            cv2.polylines(image, [outline], True, value, round(2 * grow_px * _FINER), cv2.LINE_8, _SHIFT)


def _remove_fringe(colours: Image, cover: Mask) -> Image:
    """Return the colours without the black that shrinking has mixed into the edge."""
    share = np.maximum(cover, 1).astype(np.float32)[..., None] / 255
    return np.asarray(np.clip(colours / share, 0, 255), np.uint8)


def _add_letters(stamp: Stamp, look: BodyLook, half: int) -> Stamp:
    """Return a stamp with the letters of its type, upright and as large as the body allows."""
    room = look.radius_px * (0.66 if look.shape == "air" else 0.86)
    if look.radius_px < LETTERS_FROM_PX:
        return stamp
    letters = written(look.code, max(5, min(round(room), 18)), LIVERIES[look.side].ink, palette.INK)
    width, height = letters.size
    paint, keep = stamp.paint.copy(), stamp.keep.copy()
    middle = _middle(look)
    left, top = half + middle[0] - width // 2, half + middle[1] - height // 2
    letters.press(paint, left, top)
    under = keep[max(top, 0) : top + height, max(left, 0) : left + width]
    part = letters.keep[: under.shape[0], : under.shape[1]]
    cv2.multiply(under, part, dst=under, scale=1 / 255)
    return Stamp(paint, keep)


def _middle(look: BodyLook) -> tuple[int, int]:
    """Return the place with most room for letters: an arrowhead is wide at its back."""
    if look.shape != "air":
        return 0, 0
    angle = 2 * math.pi * look.direction / DIRECTIONS
    return round(-0.15 * look.radius_px * math.cos(angle)), round(0.15 * look.radius_px * math.sin(angle))
