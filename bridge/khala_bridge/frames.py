"""The three frames of positions, and the conversions between them.

*World*: the game's own coordinates, origin at the bottom left, y up. It never leaves the host.
*Screen*: square cells around the centre of a team's camera, origin at the top left, y down.
*Minimap*: the whole map, origin at the top left, y down; one scale for both axes, that of the longer side,
as PySC2 draws it.

Pure geometry: no unit, no observation. Above it are `khala_bridge.observe` and `khala_bridge.act`.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

CAMERA_WIDTH = 24.0
"""World units that a screen shows on each axis; PySC2's and the paper's default."""


class WorldPoint(NamedTuple):
    """A position in the world frame."""

    x: float
    y: float


class ScreenPoint(NamedTuple):
    """A position in the screen frame of some camera."""

    x: float
    y: float


class MinimapPoint(NamedTuple):
    """A position in the minimap frame."""

    x: float
    y: float


def central(places: Sequence[tuple[float, float]]) -> int:
    """Return which of some places is nearest to the middle of most of them; the first of several.

    The middle is the median on each axis, so that a few that are far away do not move it.
    """
    x, y = (median(place[axis] for place in places) for axis in (0, 1))
    return min(range(len(places)), key=lambda index: (places[index][0] - x) ** 2 + (places[index][1] - y) ** 2)


@dataclass(frozen=True, slots=True)
class MapFrame:
    """The map: its size and its playable part in world units, and the size of its minimap."""

    width: float
    height: float
    playable: tuple[float, float, float, float]
    """x0, y0, x1, y1 in the world frame."""
    minimap_size: float = 64.0

    @property
    def _cells_per_unit(self) -> float:
        return self.minimap_size / max(self.width, self.height)

    @property
    def cell(self) -> float:
        """World units that a cell of the minimap is wide."""
        return 1.0 / self._cells_per_unit

    def minimap(self, x: float, y: float) -> MinimapPoint:
        """Return the minimap position of a world position."""
        scale = self._cells_per_unit
        return MinimapPoint(x * scale, (self.height - y) * scale)

    def world(self, point: MinimapPoint) -> WorldPoint:
        """Return the world position of a minimap position; the inverse of `minimap`."""
        scale = self._cells_per_unit
        return WorldPoint(point.x / scale, self.height - point.y / scale)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The playable part in minimap cells: x0, y0, x1, y1."""
        left, bottom, right, top = self.playable
        return *self.minimap(left, top), *self.minimap(right, bottom)

    def holds(self, point: WorldPoint) -> bool:
        """Return True if a world position is on the playable part of the map."""
        x0, y0, x1, y1 = self.playable
        return x0 <= point.x <= x1 and y0 <= point.y <= y1


@dataclass(frozen=True, slots=True)
class Camera:
    """A square view of the world around a centre; virtual, so it may reach beyond the map."""

    x: float
    y: float
    size: float = CAMERA_WIDTH
    """Extent of the screen frame on both axes, in its own cells."""

    @property
    def _cells_per_unit(self) -> float:
        return self.size / CAMERA_WIDTH

    def screen(self, x: float, y: float) -> ScreenPoint:
        """Return the screen position of a world position; outside of `[0, size)` if the camera does not see it."""
        scale = self._cells_per_unit
        half = CAMERA_WIDTH / 2
        return ScreenPoint((x - self.x + half) * scale, (self.y - y + half) * scale)

    def world(self, point: ScreenPoint) -> WorldPoint:
        """Return the world position of a screen position; the inverse of `screen`."""
        scale = self._cells_per_unit
        half = CAMERA_WIDTH / 2
        return WorldPoint(point.x / scale - half + self.x, self.y + half - point.y / scale)

    def bounds(self, world: MapFrame) -> tuple[float, float, float, float]:
        """Return the part of the screen that is on the playable map: x0, y0, x1, y1 in screen cells."""
        left, bottom, right, top = world.playable
        x0, y0 = self.screen(left, top)
        x1, y1 = self.screen(right, bottom)
        return max(0.0, x0), max(0.0, y0), min(self.size, x1), min(self.size, y1)


def sees(centres: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which world positions cameras at these centres have on their screens: (t, 2), (n, 2) → (t, n)."""
    half = CAMERA_WIDTH / 2
    right, down = places[:, 0] - centres[:, :1], centres[:, 1:] - places[:, 1]
    seen: NDArray[np.bool_] = (right >= -half) & (right < half) & (down >= -half) & (down < half)
    return seen
