"""The map of a battle in the grids of SMAC."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.battle import BattleGround

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]


class Board(NamedTuple):
    """The map, with a margin around it that is wide enough for what agents see of it."""

    size: tuple[int, int]
    extent: tuple[int, int]
    """Width and height of the playable part."""
    margin: int
    open: Bools
    """By x, y: where units can walk; nowhere off the map."""
    walkable: Floats
    """The same for observations: 1 off the map."""
    height: Floats
    """0 to 1; 1 off the map."""

    @classmethod
    def of(cls, ground: BattleGround, move_amount: float) -> Self:
        """Return the board of a map.

        SMAC reads heights from the north where the game writes them from the south; its observations are so.
        """
        x0, y0, x1, y1 = ground.playable
        margin = math.ceil(2 * move_amount) + 1
        walkable = ground.walkable.T
        height = np.flip(ground.height.T, 1) / 255
        around = np.pad(walkable.astype(np.float64), margin, constant_values=1.0)
        heights = np.pad(height, margin, constant_values=1.0)
        return cls(ground.size, (x1 - x0, y1 - y0), margin, np.pad(walkable, margin), around, heights)
