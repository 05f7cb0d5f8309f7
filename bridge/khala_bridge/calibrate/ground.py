"""Where on a map there is level ground with nothing on it, asked of the game and not of a file.

A map of one name may be another one in another game, so probes take places from here and never name coordinates.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from khala_bridge.errors import GameError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

    from numpy.typing import NDArray

Point: TypeAlias = tuple[float, float]

_KEEP_OFF = 17.0
"""World units between a place and a town hall: farther than idle units look for enemies."""


def grid(image: Any) -> NDArray[np.uint8]:
    """Return an image of the API as an array, [y, x] in world units, with y upwards.

    Args:
        image: with 1 or 8 bits for each cell.
    """
    cells = np.frombuffer(image.data, dtype=np.uint8)
    if image.bits_per_pixel == 1:
        cells = np.unpackbits(cells)
    width, height = image.size.x, image.size.y
    return cells[: width * height].reshape(height, width)


class Ground:
    """The level ground of a map: the cells of its most common height that can be walked on."""

    def __init__(self, start_raw: Any, halls: Iterable[Point]) -> None:
        """Read the map's description, and keep away from town halls."""
        walkable = grid(start_raw.pathing_grid) > 0
        height = grid(start_raw.terrain_height)
        area = start_raw.playable_area
        inside = np.zeros_like(walkable)
        inside[area.p0.y + 3 : area.p1.y - 3, area.p0.x + 3 : area.p1.x - 3] = True
        levels = np.bincount(height[walkable & inside], minlength=1)
        free = walkable & inside & (height == int(levels.argmax()))
        ys, xs = np.indices(free.shape)
        for x, y in halls:
            free &= (xs + 0.5 - x) ** 2 + (ys + 0.5 - y) ** 2 > _KEEP_OFF**2
        self._free = free

    def places(self, width: int, height: int) -> list[Point]:
        """Return the middles of free rectangles that do not overlap, from the south-west on.

        Raises:
            GameError: there is none of that size.
        """
        found = list(self._places(width, height))
        if not found:
            raise GameError(
                f"the map has no level ground of {width} x {height}: put Blizzard's map pack Melee into Maps"
            )
        return found

    def _places(self, width: int, height: int) -> Iterator[Point]:
        rows, columns = self._free.shape
        for y in range(0, rows - height + 1, height):
            x = 0
            while x <= columns - width:
                if self._free[y : y + height, x : x + width].all():
                    yield x + width / 2, y + height / 2
                    x += width
                else:
                    x += 1
