"""Units as small images with soft edges, made once for each look and stamped wherever such a unit is.

A look is a type in a side's colours, at a size, facing one of a few directions. Above: `scene.py`.
Below: `silhouettes.py`, `palette.py`.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from simulator.api.painting import palette
from simulator.api.painting.silhouettes import Class, class_of, code_of, outline_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from simulator.api.painting.palette import Colour
    from simulator.records import UnitType

    Image = NDArray[np.uint8]
    Mask = NDArray[Any]  # of bytes; OpenCV's functions do not say so

DIRECTIONS = 24
"""Directions in which a unit is drawn facing."""
FINER, LARGE = 4, 12.0
"""How many times finer than its pixels a sprite is drawn; half of it from this radius on."""
REACH = 1.8
"""Half of a sprite's size in radii of its unit: the longest outline and its shadow."""
ONE_LETTER, ALL_LETTERS = 4.6, 7.5
"""Radius in pixels from which a unit carries the first of its letters, and all of them."""
UPRIGHT = frozenset({Class.STRUCTURE, Class.MINERALS, Class.GEYSER, Class.ROCKS, Class.BARRIER})
NOSE = ((1.22, 0), (0.74, 0.2), (0.74, 0))
"""The tick that shows where a unit faces, as half an outline."""
GHOST, UNFINISHED = 0.5, 0.75
"""Opacity of what is cloaked or not real, and of what is being built."""


@dataclasses.dataclass(frozen=True)
class Look:
    """Everything that one sprite depends on."""

    unit: UnitType = dataclasses.field(hash=False, compare=False)
    type_id: int
    side: int  # Alliance
    radius: float  # pixels
    direction: int  # of DIRECTIONS, counter-clockwise from the right
    ghost: bool  # cloaked, burrowed or a hallucination
    unfinished: bool  # a structure that is being built


@dataclasses.dataclass(frozen=True)
class Sprite:
    """An image that is laid over another: `paint + image * keep / 255`."""

    paint: Image  # [h, w, 3]
    keep: Image  # [h, w, 3] 255 where nothing is painted; three times the same, which is ten times as fast as once
    left: int  # columns from the unit's pixel to the first one
    top: int

    def stamp(self, image: Image, column: int, row: int) -> None:
        """Lays the sprite over an image, the unit at this pixel; what is outside is left away."""
        left, top = column + self.left, row + self.top
        (rows, columns), (height, width) = image.shape[:2], self.paint.shape[:2]
        x0, y0, x1, y1 = max(0, left), max(0, top), min(columns, left + width), min(rows, top + height)
        if x0 >= x1 or y0 >= y1:
            return
        inside = (slice(y0 - top, y1 - top), slice(x0 - left, x1 - left))
        region = image[y0:y1, x0:x1]
        cv2.multiply(region, self.keep[inside], dst=region, scale=1 / 255)
        cv2.add(region, self.paint[inside], dst=region)


@functools.lru_cache(maxsize=4096)
def sprite_of(look: Look) -> Sprite:
    """The sprite of a look."""
    return _Easel(look).sprite()


class _Easel:
    """One sprite in the making: masks are drawn at several times its size, shrunk, and laid over each other."""

    def __init__(self, look: Look) -> None:
        self.look = look
        self.kind = class_of(look.unit)
        self.livery = palette.livery_of(look.unit, look.side)
        self.half = math.ceil(look.radius * REACH) + 2
        self.side = 2 * self.half + 1
        self.finer = FINER if look.radius < LARGE else FINER // 2
        self.size = self.side * self.finer
        self.colour = np.zeros((self.side, self.side, 3), np.float32)
        self.cover = np.zeros((self.side, self.side, 1), np.float32)

    def sprite(self) -> Sprite:
        body = self._body()
        rim = cv2.dilate(body, _disc(self._rim_width()))
        if self.look.unit.flying:
            self._shadow(rim)
        self._lay(rim, self.livery.rim)
        self._lay(body, self.livery.body)
        self._light(body)
        self._details(body)
        if not self.look.ghost or self.look.radius >= ALL_LETTERS:
            self._letters()
        return self._finish()

    def _points(self, half_outline: tuple[tuple[float, float], ...], scale: float = 1.0) -> NDArray[np.float64]:
        """A mirrored outline in pixels of the easel."""
        left = np.array(half_outline) * scale
        whole = np.concatenate([left, left[::-1] * (1, -1)])
        angle = 0.0 if self.kind in UPRIGHT else self.look.direction * 2 * math.pi / DIRECTIONS
        cos, sin = math.cos(angle), math.sin(angle)
        x, y = whole[:, 0] * cos - whole[:, 1] * sin, whole[:, 0] * sin + whole[:, 1] * cos
        middle, radius = self.size / 2, self.look.radius * self.finer
        return np.stack([middle + x * radius, middle - y * radius], axis=1)

    def _mask(self, points: NDArray[np.float64]) -> Mask:
        mask = np.zeros((self.size, self.size), np.uint8)
        cv2.fillPoly(mask, [np.round(points).astype(np.int32)], 255)
        return mask

    def _body(self) -> Mask:
        return self._mask(self._points(outline_of(self.look.unit)))

    def _rim_width(self) -> int:
        return max(self.finer * 3 // 4, round(self.look.radius * self.finer * 0.1))

    def _lay(self, mask: Mask, colour: Colour, part: float = 1.0) -> None:
        cover = self._small(mask) * part
        self.colour *= 1 - cover
        self.colour += cover * np.array(colour, np.float32)
        self.cover += (1 - self.cover) * cover

    def _small(self, mask: Mask) -> NDArray[np.float32]:
        small = cv2.resize(mask, (self.side, self.side), interpolation=cv2.INTER_AREA)
        return small.astype(np.float32)[..., None] / np.float32(255)

    def _shadow(self, shape: Mask) -> None:
        shift = self.look.radius * self.finer * 0.38
        move = np.array([[0.92, 0, self.size * 0.04 + shift], [0, 0.92, self.size * 0.04 + shift * 1.2]], np.float32)
        soft = cv2.GaussianBlur(cv2.warpAffine(shape, move, (self.size, self.size)), (0, 0), self.finer * 0.6)
        self._lay(soft, (0, 0, 0), 0.5)

    def _light(self, body: Mask) -> None:
        """Bodies are lighter to the upper left."""
        ramp = np.linspace(0.35, -0.35, self.side, dtype=np.float32)
        glow = (ramp[:, None] + ramp[None, :])[..., None]
        self.colour *= 1 + glow * self._small(body)

    def _details(self, body: Mask) -> None:
        look, livery = self.look, self.livery
        if self.kind is Class.STRUCTURE:
            inner = cv2.erode(body, _disc(max(self.finer, round(look.radius * self.finer * 0.16))))
            self._lay(inner, livery.dark, 0.35 if look.unfinished else 0.8)
        if self.kind is Class.MASSIVE or self.kind is Class.CAPITAL:
            ring = cv2.erode(body, _disc(max(self.finer, round(look.radius * self.finer * 0.14))))
            inner = cv2.erode(ring, _disc(self.finer * 3 // 4))
            self._lay(cv2.subtract(ring, inner), livery.rim, 0.55)
        if self.kind is Class.GEYSER:
            self._lay(self._mask(self._points(outline_of(look.unit), 0.5)), (12, 40, 20))
        if self.kind is Class.WORKER:
            self._lay(self._mask(self._points(((0.1, 0), (-0.2, 0.3), (-0.5, 0)))), livery.dark)
        if self.kind not in UPRIGHT:
            self._lay(self._mask(self._points(NOSE)), livery.ink, 0.9)
        if look.unfinished:
            line = np.arange(self.size) // (2 * self.finer)
            stripes = ((line[:, None] + line) % 2).astype(np.uint8)
            self._lay(body * stripes, livery.rim, 0.35)

    def _letters(self) -> None:
        code, radius = code_of(self.look.unit), self.look.radius
        if radius < ONE_LETTER or not code:
            return
        if radius < ALL_LETTERS:
            code = code[:1]
        mask = _text(code, self.size, min(radius * 0.95, 1.9 * radius / len(code)) * self.finer)
        outline = cv2.dilate(mask, _disc(max(2, self.finer * 3 // 4)))
        self._lay(outline, self.livery.dark, 0.9)
        self._lay(mask, self.livery.ink)

    def _finish(self) -> Sprite:
        """Colours were laid over black, so they carry their cover already."""
        thin = GHOST if self.look.ghost else UNFINISHED if self.look.unfinished else 1.0
        if self.kind is Class.BARRIER:
            thin *= GHOST
        keep = np.repeat(np.round((1 - self.cover * thin) * 255), 3, axis=2).astype(np.uint8)
        paint = np.clip(np.round(self.colour * thin), 0, 255 - keep).astype(np.uint8)
        rows, columns = (np.flatnonzero((keep[..., 0] < 255).any(axis=axis)) for axis in (1, 0))
        box = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        left, top = int(columns[0]) - self.half, int(rows[0]) - self.half
        return Sprite(np.ascontiguousarray(paint[box]), np.ascontiguousarray(keep[box]), left, top)


@functools.cache
def _disc(radius: int) -> Mask:
    result: Mask = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    return result


def _text(text: str, size: int, height: float) -> Mask:
    """Capitals of this height in the middle of a square mask."""
    font, mask = cv2.FONT_HERSHEY_SIMPLEX, np.zeros((size, size), np.uint8)
    (_, unit), _ = cv2.getTextSize("H", font, 1.0, 1)
    scale = height / unit
    thickness = max(1, round(height * 0.15))
    (width, tall), _ = cv2.getTextSize(text, font, scale, thickness)
    at = (round((size - width) / 2), round((size + tall) / 2))
    cv2.putText(mask, text, at, font, scale, 255, thickness, cv2.LINE_AA)
    return mask
