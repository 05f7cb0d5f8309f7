"""Creep: which cells it covers, and the sources it spreads from.

A source covers the cells of its mask one after the other, those near its middle first, and gives them up again from the
outside when it is gone; a cell bears creep while any source covers it, or where the map has painted it. Masks, periods
and delays depend on the game version (``data/tables/<version>/creep.json``); how many cells come in one period, and in
which order, is an estimate (see ``data/mechanics.yaml``).

State and its bookkeeping only: ``systems.creep`` decides which units are sources, and what creep does.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import TYPE_CHECKING, Final

import numpy as np

GENERATING: Final = "makeCreep2x2Overlord"
"""The buff of an Overlord that generates creep."""

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.maps.game_map import MapTerrain

    Bools = NDArray[np.bool_]
    Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False, slots=True)
class Spread:
    """How creep spreads from units of one type.

    ``cells`` (k, 2) are offsets ``(x, y)`` from the cell of the unit's middle, the nearest first; the first ``birth``
    of them are covered at once. ``delay_loops`` is how long the unit must stand before.
    """

    unit: str
    period_loops: float
    cells: Ints
    birth: int
    delay_loops: float = 0.0


@lru_cache(maxsize=4)
def spreads(version: str) -> dict[str, Spread]:
    """Return how creep spreads in a game version, by the unit type's name."""
    path = resources.files("khala_simulator.data") / "tables" / version / "creep.json"
    table = json.loads(path.read_text(encoding="utf-8"))
    masks = {row["id"]: _cells(row["area"], row["rows"]) for row in table["masks"]}
    return {row["unit"]: _spread(row, masks[row["birth"]], masks[row["grown"]]) for row in table["rows"]}


def _cells(area: list[int], rows: list[str]) -> set[tuple[int, int]]:
    """Return the marked cells of a mask, whose first row is its top."""
    left, top = area[0], area[3]
    return {(left + x, top - 1 - line) for line, text in enumerate(rows) for x, mark in enumerate(text) if mark == "o"}


def _spread(row: dict[str, object], birth: set[tuple[int, int]], grown: set[tuple[int, int]]) -> Spread:
    order = sorted(grown | birth, key=lambda cell: (cell not in birth, cell[0] ** 2 + cell[1] ** 2, cell))
    return Spread(
        unit=str(row["unit"]),
        period_loops=float(str(row["period_loops"])),
        cells=np.array(order, dtype=np.int64),
        birth=len(birth),
        delay_loops=float(str(row.get("delay_loops", 0.0))),
    )


@dataclass(slots=True)
class CreepSource:
    """One place from which creep spreads, or recedes when ``fades``.

    ``tag`` is the unit's, ``cell`` the one of its middle, ``extent`` how many of its cells it covers, ``due`` the loop
    of its next step.
    """

    tag: int
    unit: str
    cell: tuple[int, int]
    extent: int
    due: float
    fades: bool = False


class Creep:
    """The creep of one game. ``covered`` is (h, w), replaced and never changed in place."""

    def __init__(self, terrain: MapTerrain, version: str) -> None:
        self.spreads = spreads(version)
        self.covered: Bools = terrain.creep
        self.anywhere = bool(terrain.creep.any())
        self.sources: list[CreepSource] = []
        self.has_makers = False  # whether any unit lives that makes creep, or could
        self.waiting: dict[int, tuple[float, float, int]] = {}  # tag -> where and since when a source by choice stands
        self.withering: list[int] = []  # slots of structures that need creep
        self.looked_at = -1  # the population that the sources were last compared with
        self.due = 0.0  # loop at which the next source takes a step
        self._painted: Bools = terrain.creep
        self._bears: Bools = terrain.walk | terrain.build
        self._count: NDArray[np.int32] = np.zeros(terrain.walk.shape, dtype=np.int32)

    def add(self, tag: int, unit: str, cell: tuple[int, int], loop: int, *, grown: bool) -> None:
        """Add a new source of creep, or one that already has all its creep."""
        spread = self.spreads[unit]
        source = CreepSource(tag, unit, cell, 0, loop + spread.period_loops)
        self.sources.append(source)
        self.reach(source, len(spread.cells) if grown else spread.birth)
        self.due = min(self.due, source.due)

    def reach(self, source: CreepSource, extent: int) -> None:
        """Make a source cover exactly the first ``extent`` of its cells."""
        cells = self.spreads[source.unit].cells
        extent = min(max(extent, 0), len(cells))
        changed = cells[min(extent, source.extent) : max(extent, source.extent)] + source.cell
        height, width = self._count.shape
        x, y = changed[:, 0], changed[:, 1]
        inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        self._count[y[inside], x[inside]] += 1 if extent > source.extent else -1
        source.extent = extent

    def paint(self, x0: int, y0: int, x1: int, y1: int) -> None:
        """Put permanent creep on the cells of a box (``x1`` and ``y1`` exclusive), as a map can have it."""
        self._painted = self._painted.copy()
        self._painted[max(y0, 0) : y1, max(x0, 0) : x1] = True
        self.settle()

    def settle(self) -> None:
        """Rebuild ``covered`` after sources have changed, and forget those that cover nothing any more."""
        self.sources = [source for source in self.sources if source.extent or not source.fades]
        self.covered = self._painted | ((self._count > 0) & self._bears)
        self.anywhere = bool(self.covered.any())

    def covers(self, x: float, y: float) -> bool:
        """Return whether there is creep at a point."""
        height, width = self.covered.shape
        column, row = min(max(int(x), 0), width - 1), min(max(int(y), 0), height - 1)
        return bool(self.covered[row, column])

    def content(self) -> bytes:
        """Return everything that decides the future, for the digest of the world."""
        return repr((self.sources, self.waiting, self.looked_at, self.due)).encode()
