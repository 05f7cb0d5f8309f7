"""Units as small images with soft edges, made once for each look and stamped wherever such a unit is.

The body of a type in the colours of a side is drawn once, facing right and twice as large as it will be; turning it,
shrinking it, and adding the parts that do not turn with it (shadow, light, letters) makes its sprite in one of a few
directions. Above: `scene.py`. Below: `silhouettes.py`, `palette.py`.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from khala_simulator.api.painting import palette
from khala_simulator.api.painting.silhouettes import Class, class_of, code_of, outline_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.painting.palette import Colour, PlayerColors
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType

    Image = NDArray[np.uint8]
    Floats = NDArray[np.float32]
    Mask = NDArray[Any]  # of bytes; OpenCV's functions do not say so

DIRECTIONS = 16
"""Directions in which a unit is drawn facing."""
FINER = 2
LARGE = 24.0
"""How many times larger a body is drawn than it is shown, unless its radius in pixels is large."""
MAX_RADIUS = 320.0
"""Pixels; on larger images units are drawn smaller than they are."""
REACH = 1.8
"""Half of a sprite's size in radii of its unit: the longest outline and its shadow."""
ONE_LETTER, ALL_LETTERS = 4.6, 7.5
"""Radius in pixels from which a unit carries the first of its letters, and all of them."""
LETTER_HEIGHT, LETTERS_WIDTH = 1.1, 1.6
"""Size of the letters at most, in radii."""
UPRIGHT = frozenset({Class.STRUCTURE, Class.MINERALS, Class.GEYSER, Class.ROCKS, Class.BARRIER})
RINGED = frozenset({Class.MASSIVE, Class.CAPITAL})
NOSE = ((1.22, 0), (0.74, 0.2), (0.74, 0))
"""The tick that shows where a unit faces, as half an outline."""
GHOST, UNFINISHED = 0.5, 0.75
"""Opacity of units that are cloaked or not real, and of those being built."""
SHADOW = 0.5
LIGHT = 0.35
"""How much lighter a body is at its upper left than in the middle."""
MAX_BYTES = 24 << 20
"""Sprites of one size that are kept; beyond it all are made again."""
_SHIFT = 4
"""OpenCV takes fractions of pixels as whole numbers of sixteenths."""


class SpriteLook(NamedTuple):
    """What a sprite depends on, apart from its size."""

    row: int  # of the type in the catalog
    side: int  # key of palette.LIVERIES
    direction: int  # of DIRECTIONS, counter-clockwise from the right
    veiled: bool  # cloaked, burrowed, a hallucination or remembered
    unfinished: bool  # a structure that is being built


@dataclasses.dataclass(frozen=True)
class Sprite:
    """An image that is put over another: `paint + image * keep / 255`."""

    paint: Image  # [h, w, 3]
    keep: Image  # [h, w, 3] 255 where nothing is painted; three times the same, which is ten times as fast as once
    left: int  # columns from the unit's pixel to the first one
    top: int

    def stamp(self, image: Image, column: int, row: int) -> None:
        """Put the sprite over an image, the unit at this pixel; clip what is outside."""
        left, top = column + self.left, row + self.top
        (rows, columns), (height, width) = image.shape[:2], self.paint.shape[:2]
        x0 = max(0, left)
        y0 = max(0, top)
        x1 = min(columns, left + width)
        y1 = min(rows, top + height)
        if x0 >= x1 or y0 >= y1:
            return
        inside = (slice(y0 - top, y1 - top), slice(x0 - left, x1 - left))
        region = image[y0:y1, x0:x1]
        cv2.multiply(region, self.keep[inside], dst=region, scale=1 / 255)
        cv2.add(region, self.paint[inside], dst=region)


class Wardrobe:
    """All sprites at one scale; they are made when they are first needed."""

    def __init__(self, units: tuple[UnitType, ...], pixels_per_cell: float) -> None:
        self._units, self._scale = units, pixels_per_cell
        self._bodies: dict[tuple[int, int, bool], Floats] = {}
        self._sprites: dict[SpriteLook, Sprite] = {}
        self._bytes = 0

    def sprite(self, look: SpriteLook) -> Sprite:
        """Return the sprite of a look."""
        sprite = self._sprites.get(look)
        if sprite is None:
            sprite = self._sprites[look] = self._make(look)
            self._bytes += 2 * sprite.paint.nbytes
            if self._bytes > MAX_BYTES:
                self._sprites = {look: sprite}
                self._bodies = {}
                self._bytes = 0
        return sprite

    def _make(self, look: SpriteLook) -> Sprite:
        unit = self._units[look.row]
        livery = palette.livery_of(unit, look.side)
        radius = max(unit.radius_shown, 0.1) * self._scale
        radius = min(radius, MAX_RADIUS)
        key = (look.row, look.side, look.unfinished)
        body = self._bodies.get(key)
        if body is None:
            body = self._bodies[key] = draw_body(unit, livery, radius, unfinished=look.unfinished)
            self._bytes += body.nbytes
        upright = class_of(unit) in UPRIGHT
        image = _turn(body, 0.0 if upright else 2 * math.pi * look.direction / DIRECTIONS, _finer(radius))
        image[..., :3] *= _light(len(image))
        if unit.flying:
            image = _over(_shadow(image[..., 3], radius), image)
        code = code_of(unit) if radius >= ONE_LETTER else ""
        if code:
            image = _over(image, _letters(code if radius >= ALL_LETTERS else code[:1], radius, len(image), livery))
        opacity = GHOST if look.veiled or class_of(unit) is Class.BARRIER else UNFINISHED if look.unfinished else 1.0
        return _cut_out(image * np.float32(opacity))


@functools.lru_cache(maxsize=4)
def wardrobe(catalog: Catalog, pixels_per_cell: float) -> Wardrobe:
    """Return the sprites of a catalog at this scale, shared by all games of the process."""
    return Wardrobe(catalog.units, pixels_per_cell)


# images of four channels: red, green, blue, all times the cover, and the cover, 0 to 255 ------------------------------


def draw_body(unit: UnitType, livery: PlayerColors, radius: float, *, unfinished: bool) -> Floats:
    """Return a unit facing right, `_finer` times larger than it is shown: its rim, its body, and its details."""
    kind = class_of(unit)
    easel = _Easel(radius)
    body = easel.outline(outline_of(unit))
    easel.lay(cv2.dilate(body, _disc(max(1, round(easel.radius * 0.1)))), livery.rim)
    easel.lay(body, livery.body)
    if kind is Class.STRUCTURE:
        easel.lay(easel.inside(body, 0.16), livery.dark, 0.35 if unfinished else 0.8)
    if kind in RINGED:
        ring = easel.inside(body, 0.14)
        easel.lay(cv2.subtract(ring, cv2.erode(ring, _disc(1))), livery.rim, 0.55)
    if kind is Class.GEYSER:
        easel.lay(easel.outline(outline_of(unit), 0.5), (12, 40, 20))
    if kind is Class.WORKER:
        easel.lay(easel.outline(((0.1, 0), (-0.2, 0.3), (-0.5, 0))), livery.dark)
    if kind not in UPRIGHT:
        easel.lay(easel.outline(NOSE), livery.ink, 0.9)
    if unfinished:
        easel.lay(easel.stripes(body), livery.rim, 0.35)
    return easel.image


class _Easel:
    """A body in the making: masks over each other in their colours."""

    def __init__(self, radius: float) -> None:
        self.finer = _finer(radius)
        self.radius = radius * self.finer
        self.size = (2 * _half(radius) + 1) * self.finer
        self.image = np.zeros((self.size, self.size, 4), np.float32)

    def outline(self, half: tuple[tuple[float, float], ...], scale: float = 1.0) -> Mask:
        """Return the mask of a mirrored outline."""
        left = np.array(half) * (scale * self.radius)
        points = np.concatenate([left, left[::-1] * (1, -1)]) * (1, -1) + (self.size - 1) / 2
        mask = np.zeros((self.size, self.size), np.uint8)
        cv2.fillPoly(mask, [np.round(points * (1 << _SHIFT)).astype(np.int32)], 255, cv2.LINE_AA, _SHIFT)
        return mask

    def inside(self, mask: Mask, margin: float) -> Mask:
        """Return a mask without a margin, given in radii."""
        return cv2.erode(mask, _disc(max(self.finer, round(self.radius * margin))))

    def stripes(self, mask: Mask) -> Mask:
        """Return every other diagonal stripe of a mask."""
        line = np.arange(self.size) // (2 * self.finer)
        return mask * ((line[:, None] + line) % 2).astype(np.uint8)

    def lay(self, mask: Mask, colour: Colour, part: float = 1.0) -> None:
        """Paint over the present image."""
        cover = mask.astype(np.float32)[..., None] * np.float32(part / 255)
        self.image *= 1 - cover
        self.image += cover * np.array([*colour, 255], np.float32)


def _finer(radius: float) -> int:
    return FINER if radius < LARGE else 1


def _half(radius: float) -> int:
    return math.ceil(radius * REACH) + 2


def _turn(body: Floats, angle: float, finer: int) -> Floats:
    """Return a body turned counter-clockwise and shrunk to the size in which it is shown."""
    side, cos, sin = len(body) // finer, math.cos(angle) * finer, math.sin(angle) * finer
    middle, large = (side - 1) / 2, (len(body) - 1) / 2
    inverse = np.array(
        [[cos, -sin, large - (cos - sin) * middle], [sin, cos, large - (sin + cos) * middle]], np.float32
    )
    turned = cv2.warpAffine(body, inverse, (side, side), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    return np.asarray(turned, np.float32)


def _over(lower: Floats, upper: Floats) -> Floats:
    result: Floats = upper + lower * (1 - upper[..., 3:] * np.float32(1 / 255))
    return result


def _shadow(cover: Floats, radius: float) -> Floats:
    """Return the shadow of a shape, to the lower right of it."""
    shift = radius * 0.38
    side = len(cover)
    move = np.array([[0.92, 0, side * 0.04 + shift], [0, 0.92, side * 0.04 + shift * 1.2]], np.float32)
    image = np.zeros((side, side, 4), np.float32)
    image[..., 3] = cv2.warpAffine(cover, move, (side, side)) * np.float32(SHADOW)
    return image


@functools.lru_cache(maxsize=64)
def _light(side: int) -> Floats:
    ramp = np.linspace(LIGHT, -LIGHT, side, dtype=np.float32)
    return (1 + ramp[:, None] + ramp[None, :])[..., None]


@functools.lru_cache(maxsize=512)
def _letters(code: str, radius: float, side: int, livery: PlayerColors) -> Floats:
    """Return an image with capitals in its middle, with an edge around them."""
    size = side * FINER
    mask = _text(code, size, LETTER_HEIGHT * radius * FINER, LETTERS_WIDTH * radius * FINER)
    image = np.zeros((size, size, 4), np.float32)
    for shape, colour, part in ((cv2.dilate(mask, _disc(1)), livery.dark, 0.9), (mask, livery.ink, 1.0)):
        cover = shape.astype(np.float32)[..., None] * np.float32(part / 255)
        image = image * (1 - cover) + cover * np.array([*colour, 255], np.float32)
    return np.asarray(cv2.resize(image, (side, side), interpolation=cv2.INTER_AREA), np.float32)


def _text(text: str, size: int, height: float, width: float) -> Mask:
    """Return a square mask with capitals in its middle, no larger than this."""
    font = cv2.FONT_HERSHEY_SIMPLEX
    mask = np.zeros((size, size), np.uint8)
    (wide, tall), _ = cv2.getTextSize(text, font, 1.0, 1)
    scale = min(height / tall, width / wide)
    thickness = max(1, round(width * 0.09))
    at = (round((size - wide * scale) / 2), round((size + tall * scale) / 2))
    cv2.putText(mask, text, at, font, scale, 255, thickness, cv2.LINE_AA)
    x, y, wide, tall = cv2.boundingRect(mask)  # fonts differ in what they call the size of a text
    return np.roll(mask, ((size - tall) // 2 - y, (size - wide) // 2 - x), axis=(0, 1))


def _cut_out(image: Floats) -> Sprite:
    """Return the painted part of an image."""
    cover = np.minimum(np.round(image[..., 3]), 255)
    rows, columns = np.flatnonzero(cover.any(axis=1)), np.flatnonzero(cover.any(axis=0))
    box = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    keep = (255 - cover[box]).astype(np.uint8)
    paint = np.minimum(np.round(image[box][..., :3]), cover[box][..., None]).astype(np.uint8)
    half = len(image) // 2
    return Sprite(paint, cv2.merge([keep] * 3).astype(np.uint8), int(columns[0]) - half, int(rows[0]) - half)


@functools.cache
def _disc(radius: int) -> Mask:
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
