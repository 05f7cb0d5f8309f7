"""Where a structure may stand, and which place is the best one if an agent leaves it open.

`legal` is what the game demands: ground, creep, power, distance to resources. `good` is what a player wants as well:
the ways of workers and the places of town halls stay free, an add-on has room, and no unit is walled in. Everything is
computed for the whole map at once, on grids `[x, y]` of the cells that `Footprint.cell` returns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from khala_bridge.frames import WorldPoint
from khala_bridge.rules import Ledger
from khala_bridge.state.ground import footprint_of, sites
from khala_bridge.state.ground.footprints import ADDON
from khala_bridge.state.ground.land import SEEN_NOW
from khala_bridge.state.ground.resources import coordinates, everywhere

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from khala_bridge.state.ground import Footprint, Land
    from khala_bridge.state.ground.footprints import Cells
    from khala_bridge.state.ground.terrain import Bools, Floats

    Costs: TypeAlias = NDArray[np.floating[Any]]

PYLON_REACH: Final = 4
"""A structure of 3 x 3 whose middle is at most this many cells away on both axes is in the field of a Pylon (6.5)."""
BASE_REACH: Final = 16.0
"""A place that is farther from every town hall, as the crow flies, belongs to no base."""


NO_ORDERS: Final = Ledger(0.0, 0.0, 0.0)
"""The accounts before the first call of a turn, as far as ground goes."""


def legal(land: Land, ledger: Ledger, structure: str) -> Bools:
    """Return the cells (w, h) where the game allows the structure, as far as the player can know."""
    return _fitting(land, structure, _ground(land, ledger, structure))


def _fitting(land: Land, structure: str, ground: Bools) -> Bools:
    """Return the cells (w, h) where a structure may stand if its cells may be on this ground."""
    site = sites()[structure]
    footprint = footprint_need(structure)
    result = everywhere(ground & land.clear if site.clear else ground, footprint.cells)
    return result & land.power_cells(corner=on_corner(structure)) if site.ground == "powered" else result


def _ground(land: Land, ledger: Ledger, structure: str) -> Bools:
    """Return the cells (w, h) on which a part of the structure may stand."""
    site = sites()[structure]
    ground = land.free & ~promised_cells(land, ledger)
    if site.ground == "creep":
        ground &= land.creep
    elif site.ground != "any":
        ground &= ~land.creep
    return ground & (land.sight >= SEEN_NOW) if site.seen else ground


def promised_cells(land: Land, ledger: Ledger) -> Bools:
    """Return the cells (w, h) on which earlier calls of this turn are going to build."""
    taken = np.zeros(land.ground.size, np.bool_)
    for x0, y0, x1, y1 in ledger.sites:
        taken[max(int(x0), 0) : int(np.ceil(x1)), max(int(y0), 0) : int(np.ceil(y1))] = True
    return taken


def any_good(land: Land, structure: str) -> bool:
    """Return True if `good` marks a cell at the beginning of a turn; structures of the same needs share the answer."""
    site = sites()[structure]
    footprint = footprint_need(structure)
    key = site.ground, site.clear, site.seen, footprint.rows
    if key not in land.answers:
        land.answers[key] = _is_good(land, structure, _good_before.get(key)) or _find_good(land, structure, key)
    found: bool = land.answers[key]
    return found


_good_before: dict[object, tuple[int, int]] = {}
"""By needs, a cell that was good last: most often it still is, and the map need not be searched; never the answer."""


def _find_good(land: Land, structure: str, key: object) -> bool:
    ground = _ground(land, NO_ORDERS, structure) & ~land.kept & (land.sight > 0)
    cells = np.argwhere(_fitting(land, structure, ground) & _reachable(land))
    if len(cells):
        x, y = cells[len(cells) // 2].tolist()
        _good_before[key] = x, y
    return bool(len(cells))


def _is_good(land: Land, structure: str, cell: tuple[int, int] | None) -> bool:
    """Return True if `good` marks a cell, by a look at the cells under the structure alone; not for town halls."""
    site = sites()[structure]
    footprint = footprint_need(structure)
    if (
        cell is None
        or site.clear
        or not all(land.ground.holds(cell[0] + dx, cell[1] + dy) for dx, dy in footprint.cells)
    ):
        return False
    x, y = np.array(footprint.cells).T + np.array(cell)[:, None]
    ground = land.free[x, y] & ~land.kept[x, y] & (land.sight[x, y] >= (SEEN_NOW if site.seen else 1))
    if site.ground != "any":
        ground &= land.creep[x, y] == (site.ground == "creep")
    powered = site.ground != "powered" or bool(land.power_cells(corner=on_corner(structure))[cell])
    return bool(ground.all()) and powered and bool(_reachable(land)[cell])


def good(land: Land, ledger: Ledger, structure: str) -> Bools:
    """Return the cells (w, h) where a structure may stand out of the way; the least important wish is dropped first.

    Never dropped: the game's demands, the ways of workers, the places of town halls, and that the place was seen and
    workers can walk to it.
    """
    ground = _ground(land, ledger, structure) & ~land.kept
    result = _fitting(land, structure, ground & (land.sight > 0)) & _reachable(land)
    wishes = [_open_around(land, ledger, _with_addon(structure))]
    if sites()[structure].addon:
        wishes.insert(0, everywhere(ground, ADDON))
    for wish in wishes:
        narrowed = result & wish
        if narrowed.any():
            result = narrowed
    return result


def best(grid: Bools, cost: Costs) -> tuple[int, int] | None:
    """Return the marked cell with the least cost; among equal ones the one with the least coordinates."""
    costs = np.where(grid, np.round(cost, 3), np.inf)
    place = int(np.argmin(costs))
    x, y = divmod(place, grid.shape[1])
    return (x, y) if np.isfinite(costs[x, y]) else None


def footprint_need(structure: str) -> Footprint:
    """Return the cells that a structure needs; every structure that can be placed has some."""
    found = footprint_of(structure)
    assert found is not None, f"{structure} stands in sites.yaml and has no footprint"
    return found


def on_corner(structure: str) -> bool:
    """Return True if the middle of a structure is on the corner of its cell."""
    return footprint_need(structure).size[0] % 2 == 0


def _with_addon(structure: str) -> Cells:
    cells = footprint_need(structure).cells
    return (*cells, *ADDON) if sites()[structure].addon else cells


def _reachable(land: Land) -> Bools:
    """Return the cells (w, h) that a worker can walk to from any own town hall; all cells if there is none."""
    reached = np.zeros(land.ground.size, np.bool_)
    for hall in land.own_halls:
        reached |= np.isfinite(land.ground.ways_from(WorldPoint(hall.pos.x, hall.pos.y)))
    return reached if land.own_halls else np.ones_like(reached)


def _open_around(land: Land, ledger: Ledger, cells: Cells) -> Bools:
    """Return the cells (w, h) where a structure cuts no way off: the walkable cells around it are one piece.

    A unit can walk round such a structure to every place that it could reach before: no gap is closed, no unit is
    locked in and no add-on walled up, wherever the structure stands.
    """
    open_ = land.open & ~land.planned & ~promised_cells(land, ledger)
    width, height = open_.shape
    ring = _ring(cells)
    reach = max(max(abs(dx), abs(dy)) for dx, dy in ring)
    padded = np.pad(open_, reach)
    around = [padded[reach + dx : reach + dx + width, reach + dy : reach + dy + height] for dx, dy in ring]
    pieces = np.zeros(open_.shape, np.int8)
    for here, following in zip(around, (*around[1:], around[0]), strict=True):
        pieces += here & ~following
    some: Bools = np.logical_or.reduce(around)
    return some & (pieces <= 1)


def _ring(cells: Cells) -> list[tuple[int, int]]:
    """Return the cells around the rectangle of some cells, in the order of a walk around it."""
    xs, ys = zip(*cells, strict=True)
    x0, x1, y0, y1 = min(xs) - 1, max(xs) + 1, min(ys) - 1, max(ys) + 1
    bottom = [(x, y0) for x in range(x0, x1)]
    right = [(x1, y) for y in range(y0, y1)]
    top = [(x, y1) for x in range(x1, x0, -1)]
    left = [(x0, y) for y in range(y1, y0, -1)]
    return bottom + right + top + left


# the cost of a place --------------------------------------------------------------------------------------------------


def near(land: Land, points: Iterable[WorldPoint], *, reach: float = np.inf, corner: bool = False) -> Floats:
    """Return the straight distance (w, h) of each cell to the nearest of some points; infinite beyond a reach.

    Measured from the cell's middle, or its lower left corner, which is the middle of structures of 2 x 2.
    """
    x, y = coordinates(land.ground.size)
    shift = 0.0 if corner else 0.5
    squared = np.full(land.ground.size, np.inf, np.float32)
    for point in points:
        np.minimum(squared, (x + (shift - point.x)) ** 2 + (y + (shift - point.y)) ** 2, out=squared)
    least: Floats = np.sqrt(squared)
    least[least > reach] = np.inf
    return least


def new_power(land: Land, ledger: Ledger) -> Floats:
    """Return the number (w, h) of new places for a structure of 3 x 3, in no unit's way, that a Pylon would power."""
    places = everywhere(_ground(land, ledger, "Gateway") & ~land.kept, footprint_need("Gateway").cells)
    places &= ~land.power_cells(corner=False)
    for left, bottom, right, top in ledger.sites:  # it may be a Pylon; either way the next one stands elsewhere
        x, y = int((left + right) / 2), int((bottom + top) / 2)
        places[max(x - PYLON_REACH, 0) : x + PYLON_REACH + 1, max(y - PYLON_REACH, 0) : y + PYLON_REACH + 1] = False
    return _sum_around(places, PYLON_REACH)


def _sum_around(grid: Bools, reach: int) -> Floats:
    """Return the number (w, h) of marked cells at most `reach` steps below and to the left, or fewer above."""
    sums = np.pad(grid.astype(np.float32).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    low, high = ([np.clip(np.arange(n) + shift, 0, n) for n in grid.shape] for shift in (-reach, reach))
    total: Floats = (
        sums[np.ix_(high[0], high[1])]
        - sums[np.ix_(low[0], high[1])]
        - sums[np.ix_(high[0], low[1])]
        + sums[np.ix_(low[0], low[1])]
    )
    return total
