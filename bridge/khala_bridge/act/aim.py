"""Where to click on the real screen to hit a unit or a place, by one snapshot.

A click hits the topmost unit. So a unit is clicked where nothing else covers it, or where the feature layers show it
all the same; a unit that is covered completely cannot be hit. Geometry and reading only:
`khala_bridge.act.screen_executor` decides which unit to click, and why.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, TypeAlias

from khala_bridge.frames import CAMERA_WIDTH, WorldPoint
from khala_protocol.messages import Frames

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.state import Snapshot, Unit

Pixel: TypeAlias = tuple[int, int]
"""Column and row, origin at the top left."""
TRIED_PIXELS = 200
"""Pixels of a unit that are looked at, from its middle outwards: the whole disc of what is smaller than a base."""

BARE_WITHIN = 0.75
"""World units within which bare ground is as good as the place that was meant."""


class RealScreen:
    """The screen and the minimap of a snapshot, with the camera where the game has it."""

    def __init__(self, snapshot: Snapshot) -> None:
        """Read the camera of the raw data and the sizes of the feature layers."""
        sizes = snapshot.info.pictures
        self._snapshot = snapshot
        self._size, self._minimap_size = sizes.screen, sizes.minimap
        self.camera = snapshot.camera

    def pixel(self, place: WorldPoint) -> Pixel | None:
        """Return the pixel of a world position; None if the screen does not show it."""
        px = math.floor((place.x - self.camera.x) / self._scale + self._size[0] / 2)
        py = math.floor((self.camera.y - place.y) / self._scale + self._size[1] / 2)
        return (px, py) if self._holds(px, py) else None

    def minimap(self, place: WorldPoint) -> Pixel:
        """Return the minimap pixel of a world position."""
        width, height = self._minimap_size
        x, y = self._snapshot.info.frame(Frames(minimap=float(width))).minimap(place.x, place.y)
        return min(max(math.floor(x), 0), width - 1), min(max(math.floor(y), 0), height - 1)

    def hit(self, unit: Unit) -> Pixel | None:
        """Return a pixel where a click hits this unit; None if it is off the screen or covered completely.

        That is its middle if free, else the nearest pixel of its disc that no other unit covers, else the nearest
        one where the feature layers show its type and owner on top.
        """
        pixels = [pixel for pixel in self._disc(unit) if self._holds(*pixel)]
        others = self._beside(unit)
        free = (pixel for pixel in pixels if not any(self._covers(other, pixel) for other in others))
        return next(free, None) or next((pixel for pixel in pixels if self._shows(unit, pixel)), None)

    def bare(self, place: WorldPoint) -> Pixel | None:
        """Return the nearest pixel of bare ground, if there is one within `BARE_WITHIN` of a place.

        Otherwise return the pixel of the place itself; None if the screen does not show it.
        """
        middle = self.pixel(place)
        if middle is None:
            return None
        near = [u for u in self._snapshot.units.values() if math.dist(u.pos, place) <= u.radius + 1.0]
        for dx, dy in _around(int(BARE_WITHIN / self._scale)):
            pixel = (middle[0] + dx, middle[1] + dy)
            if self._holds(*pixel) and not any(self._covers(unit, pixel) for unit in near):
                return pixel
        return middle

    @property
    def _scale(self) -> float:
        """World units per pixel."""
        return CAMERA_WIDTH / min(self._size)

    def _holds(self, px: int, py: int) -> bool:
        return 0 <= px < self._size[0] and 0 <= py < self._size[1]

    def _world(self, pixel: Pixel) -> WorldPoint:
        """Return the middle of a pixel."""
        px, py = pixel
        return WorldPoint(
            self.camera.x + (px + 0.5 - self._size[0] / 2) * self._scale,
            self.camera.y - (py + 0.5 - self._size[1] / 2) * self._scale,
        )

    def _disc(self, unit: Unit) -> Iterator[Pixel]:
        """Yield the pixels of a unit from its middle outwards; at least the one of its middle."""
        px = math.floor((unit.pos.x - self.camera.x) / self._scale + self._size[0] / 2)
        py = math.floor((self.camera.y - unit.pos.y) / self._scale + self._size[1] / 2)
        reach = int(unit.radius / self._scale)
        for dx, dy in _around(reach)[:TRIED_PIXELS]:
            if (dx == dy == 0) or self._covers(unit, (px + dx, py + dy), slack=0.0):
                yield px + dx, py + dy

    def _beside(self, unit: Unit) -> list[Unit]:
        """Return the other units that touch it, seen from above."""
        return [
            other
            for other in self._snapshot.units.values()
            if other.tag != unit.tag and math.dist(other.pos, unit.pos) <= other.radius + unit.radius + self._scale
        ]

    def _covers(self, unit: Unit, pixel: Pixel, slack: float = 0.5) -> bool:
        """Return True if a unit covers a pixel; `slack` in pixels."""
        place = self._world(pixel)
        return math.dist(place, unit.pos) <= unit.radius + slack * self._scale

    def _shows(self, unit: Unit, pixel: Pixel) -> bool:
        """Return True if the feature layers show its type and owner on top, or if there are no layers."""
        layers = self._snapshot.pictures
        seen_type, seen_owner = layers.layer_pixel("unit_type", *pixel), layers.layer_pixel("player_relative", *pixel)
        return seen_type in {None, unit.unit_type} and seen_owner in {None, unit.alliance}


@functools.cache
def _around(reach: int) -> tuple[Pixel, ...]:
    """Return offsets in a square around a pixel, the nearest first."""
    square = ((dx, dy) for dx in range(-reach, reach + 1) for dy in range(-reach, reach + 1))
    return tuple(sorted(square, key=lambda offset: (offset[0] ** 2 + offset[1] ** 2, offset)))
