"""Walkability: which cells of a map a ground unit can be on, and where a structure can stand, from its cliff levels.

The game computes this from its cliff models; the rule here was found by comparing the levels of five ladder maps with
the pathing grids of the real game: 97.6 to 99.7 % of the playable cells agree and none is closed wrongly (the rest is
under structures, doodads and destructibles). Straight ramps did not occur there: theirs is extrapolation.

All grids are (h, w), row 0 at the bottom. A level is 64 a step; in between are ramps, below 64 is nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.maps.game_map import Grid

Number = TypeVar("Number", np.bool_, np.int64)

LEVEL: Final = 64
EDGE: Final = 24  # difference in height from which a neighbour is another level
RAMP_EDGE: Final = 40  # the same, beside a ramp
FARTHEST: Final = 2  # how many cells away the rule looks
RAMP_TIP: Final = 8  # above a whole level, the outermost cell of a diagonal ramp


def solid(cliff: NDArray[np.uint16]) -> Grid:
    """Return the cells that are ground at all."""
    ground: Grid = cliff >= LEVEL
    return ground


def walkable(cliff: NDArray[np.uint16], on_cliff_tile: Grid) -> Grid:
    """Return the cells that are solid and not the foot, the corner or the edge of a cliff."""
    level = cliff.astype(np.int64)
    ramp = level % LEVEL != 0
    east, west, north, south = _neighbours(level)
    higher = np.maximum.reduce([east, west, north, south]) - level
    foot = higher >= np.where(ramp, RAMP_EDGE, EDGE)
    drops = [_drop(level, ramp, other) for other in (east, west, north, south)]
    corner = (drops[0] | drops[1]) & (drops[2] | drops[3])
    y, x = np.indices(level.shape)
    odd_x, odd_y = x % 2 == 1, y % 2 == 1
    edge = (drops[0] & odd_x) | (drops[1] & ~odd_x) | (drops[2] & odd_y) | (drops[3] & ~odd_y)
    lower = [other < level for other in (east, west, north, south)]
    tip = (level % LEVEL == RAMP_TIP) & ((lower[0] & lower[1]) | (lower[2] & lower[3]))
    closed = on_cliff_tile & (foot | corner | edge | tip)
    free: Grid = solid(cliff) & ~closed
    return free


def buildable(cliff: NDArray[np.uint16], walk: Grid) -> Grid:
    """Return the walkable cells that are no ramp, nor at the top of one, corners included, nor at its foot."""
    level = cliff.astype(np.int64)
    ramp = level % LEVEL != 0
    beside = np.zeros_like(ramp)
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
        other, is_ramp = _shift(level, dy, dx), _shift(ramp, dy, dx)
        beside |= is_ramp & (other < level)
        if dx == 0 or dy == 0:  # the foot is where a walkable ramp rises straight away from the cell
            beside |= is_ramp & _shift(walk, dy, dx) & (level < other) & (other < _shift(level, 2 * dy, 2 * dx))
    free: Grid = walk & ~ramp & ~beside
    return free


def _drop(level: NDArray[np.int64], ramp: Grid, other: NDArray[np.int64]) -> Grid:
    """Return where the neighbour is a level lower; the top of a straight ramp is no drop."""
    down = level - other
    onto_ramp = ~ramp & (other % LEVEL != 0) & (down == EDGE)
    lower: Grid = (down >= EDGE) & ~onto_ramp
    return lower


def _neighbours(level: NDArray[np.int64]) -> tuple[NDArray[np.int64], ...]:
    """Return the levels to the east, west, north and south; beyond the map they continue as at its edge."""
    return tuple(_shift(level, dy, dx) for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)))


def _shift(grid: NDArray[Number], dy: int, dx: int) -> NDArray[Number]:
    """Return for each cell the value of the one ``dy`` above and ``dx`` to the right."""
    height, width = grid.shape
    padded = np.pad(grid, FARTHEST, mode="edge")
    return padded[FARTHEST + dy : FARTHEST + dy + height, FARTHEST + dx : FARTHEST + dx + width]
