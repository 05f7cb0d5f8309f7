"""Marks (`khala_bridge.observe.mark_digits`) beside units, so that a model can name what it sees; they hide little.

On large bodies they stand below the letters of the type, otherwise beside the body.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, NamedTuple

import cv2

from khala_bridge.observe.image import palette
from khala_bridge.observe.image.lettering import written
from khala_bridge.observe.image.palette import LIVERIES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.observe.image.lettering import Image, Stamp
    from khala_bridge.observe.image.palette import Side

_CELL = 4
"""Pixels of a cell of the plan of taken places."""
_WORST = 0.5
"""A mark is left out if more than this share of it would cover other marks."""
_OVER_MARK, _OVER_BODY, _FAR = 4.0, 1.0, 0.15
"""Costs of covering a mark or a body, as shares of the mark, and of being a ring further away."""
_ROOMY_PX = 30
"""Radius of a body that has room for its mark."""
_RINGS_PX = (2, 13, 24)
"""Free pixels between a body and its mark; from the second ring on a line connects them."""


class Marked(NamedTuple):
    """A thing with a mark: the mark's text, its colours, and the place of the body in pixels."""

    text: str
    side: Side
    x: int
    y: int
    radius: int


def place(image: Image, marked: Iterable[Marked], bodies: Iterable[Marked], height_px: int) -> list[Marked]:
    """Draw marks beside their bodies, the first ones at the best places.

    Args:
        image: the image to draw on.
        marked: the things with marks, most important first.
        bodies: bodies that marks should not cover.
        height_px: of the letters.

    Returns:
        The things whose marks were drawn.
    """
    height, width = image.shape[:2]
    hidden, covered = _Plan(width, height), _Plan(width, height)
    for body in bodies:
        r = round(body.radius * 0.8)
        covered.add(max(body.x - r, 0), max(body.y - r, 0), 2 * r, 2 * r)
    spots = []
    for thing in marked:
        stamp = written(thing.text, height_px, LIVERIES[thing.side].mark, palette.INK)
        spot = _on_body(thing, stamp, hidden) or _spot(thing, stamp, hidden, covered)
        if spot is not None:
            hidden.add(spot.left, spot.top, *stamp.size)
            spots.append((thing, stamp, spot))
    for thing, _, spot in spots:
        if spot.ring:
            _lead(image, thing, spot)
    for _, stamp, spot in spots:
        stamp.press(image, spot.left, spot.top)
    return [thing for thing, _, _ in spots]


class _Spot(NamedTuple):
    left: int
    top: int
    ring: int
    middle: tuple[int, int]


class _Plan:
    """The taken cells of a picture: one number with a bit for each cell, for fast lookups of rectangles."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.stride = width // _CELL + 2
        self.taken = 0

    def at(self, left: int, top: int) -> int:
        """Return the number of the cell of a pixel: the shift of a rectangle's bits there."""
        return top // _CELL * self.stride + left // _CELL

    def bits(self, width: int, height: int) -> tuple[int, int]:
        """Return the bits of a rectangle in the first cell, and their number."""
        return _rectangle(width // _CELL + 1, height // _CELL + 1, self.stride)

    def add(self, left: int, top: int, width: int, height: int) -> None:
        """Mark a rectangle that begins in the picture as taken."""
        self.taken |= self.bits(width, height)[0] << self.at(left, top)


@functools.lru_cache(1024)
def _rectangle(columns: int, rows: int, stride: int) -> tuple[int, int]:
    line = (1 << columns) - 1
    return sum(line << (row * stride) for row in range(rows)), columns * rows


_WAYS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
"""Beside a body, right first: y downwards, so that bars above it stay free."""


def _on_body(thing: Marked, stamp: Stamp, hidden: _Plan) -> _Spot | None:
    """Return the place below the letters of a large body, if it is free."""
    width, height = stamp.size
    left, top = thing.x - width // 2, thing.y + round(0.5 * thing.radius) - height // 2
    is_inside = 0 <= left <= hidden.width - width and 0 <= top <= hidden.height - height
    if thing.radius < _ROOMY_PX or not is_inside:
        return None
    if hidden.taken >> hidden.at(left, top) & hidden.bits(width, height)[0]:
        return None
    return _Spot(left, top, 0, (thing.x, thing.y))


class _Try(NamedTuple):
    """A place for a mark, from the middle of its body."""

    left: int
    top: int
    ring: int
    cost: float
    """Of the place itself."""


@functools.lru_cache(1024)
def _tries(radius: int, width: int, height: int) -> tuple[_Try, ...]:
    """Return the places for a mark of this size around a body of this radius, the best first."""
    tries = []
    for ring, gap in enumerate(_RINGS_PX):
        beside, corner = radius + gap, round(0.72 * radius) + gap
        for way, (right, down) in enumerate(_WAYS):
            reach = corner if right and down else beside
            x, y = right * (reach + width // 2), down * (reach + height // 2)
            tries.append(_Try(x - width // 2, y - height // 2, ring, _FAR * ring + way / 100))
    return tuple(tries)


def _spot(thing: Marked, stamp: Stamp, hidden: _Plan, covered: _Plan) -> _Spot | None:
    """Return the place where a mark hides least; None if every place covers other marks."""
    width, height = stamp.size
    bits, count = hidden.bits(width, height)
    marks, bodies, stride = hidden.taken, covered.taken, hidden.stride
    right_most, lowest = hidden.width - width, hidden.height - height
    best = None
    least = math.inf
    for right, down, ring, cost in _tries(thing.radius, width, height):
        if cost >= least:
            break  # all that follows costs more than the best, even if it hides nothing
        left, top = thing.x + right, thing.y + down
        if not (0 <= left <= right_most and 0 <= top <= lowest):
            continue
        at = top // _CELL * stride + left // _CELL
        over = marks >> at & bits
        if over:
            share = over.bit_count() / count
            if share > _WORST:
                continue
            cost += _OVER_MARK * share  # noqa: PLW2901  # what it would cost here
            if cost >= least:
                continue
        under = bodies >> at & bits
        if under:
            cost += _OVER_BODY * under.bit_count() / count  # noqa: PLW2901  # and this, too
        if cost < least:
            best = _Spot(left, top, ring, (left + width // 2, top + height // 2))
            least = cost
    return best


def _lead(image: Image, thing: Marked, spot: _Spot) -> None:
    """Draw a line from a body to its mark."""
    colour = palette.mix(LIVERIES[thing.side].mark, palette.INK, 0.25)
    cv2.line(image, (thing.x, thing.y), spot.middle, palette.INK, 2)
    cv2.line(image, (thing.x, thing.y), spot.middle, colour, 1)
