"""The unit types of a catalog as arrays by row: what an observation needs to know of each unit at once.

Read-only, one per catalog. Above: `sight.py` and everything that observes.
"""

from __future__ import annotations

import functools
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from khala_simulator.economy.power import SUPPLIES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType, Upgrade

    Bools = NDArray[np.bool_]
    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]

_LEVEL = re.compile(r"Level[123]$")


class Types:
    """Columns by unit row; `levels` says which upgrades count for which type."""

    def __init__(self, catalog: Catalog) -> None:
        self.catalog = catalog
        self.id: Ints = self._column(lambda unit: unit.id, np.int64)
        self.radius: Floats = self._column(lambda unit: unit.radius_shown)
        self.height: Floats = self._column(lambda unit: unit.height)
        self.supply: Floats = self._column(lambda unit: unit.supply)
        self.provides: Floats = self._column(lambda unit: unit.provides)
        self.minerals: Floats = self._column(lambda unit: unit.cost[0])
        self.vespene: Floats = self._column(lambda unit: unit.cost[1])
        self.score_make: Floats = self._column(lambda unit: unit.score_make)
        self.detect: Floats = self._column(lambda unit: unit.detect)
        self.cargo: Ints = self._column(lambda unit: unit.cargo_space, np.int64)
        self.subgroup: Ints = self._column(lambda unit: unit.subgroup, np.int64)
        self.resource: Ints = self._column(lambda unit: unit.resource_amount, np.int64)
        self.power: Floats = self._column(_field_of_power)
        self.flying: Bools = self._column(lambda unit: unit.flying, np.bool_)
        self.structure: Bools = self._column(lambda unit: unit.structure, np.bool_)
        self.army: Bools = self._column(lambda unit: unit.army, np.bool_)
        self.worker: Bools = self._column(lambda unit: unit.worker, np.bool_)
        self.armed: Bools = self._column(lambda unit: bool(unit.weapons), np.bool_)
        self.selectable: Bools = self._column(lambda unit: not unit.unselectable, np.bool_)
        self.warp_gate: Bools = self._column(lambda unit: unit.name == "WarpGate", np.bool_)
        self.larva: Bools = self._column(lambda unit: unit.name == "Larva", np.bool_)
        self.needs_power: Bools = self._column(lambda unit: unit.needs_power, np.bool_)
        self.minerals_in: Bools = self._column(lambda unit: unit.resource == "minerals", np.bool_)
        self.vespene_in: Bools = self._column(lambda unit: unit.resource == "vespene", np.bool_)

    def _column(self, value: Callable[[UnitType], object], dtype: type = np.float64) -> NDArray[Any]:
        return np.array([value(unit) for unit in self.catalog.units], dtype=dtype)

    @functools.lru_cache(maxsize=64)  # noqa: B019  # lives as long as its catalog, which is the process
    def levels(self, upgrades: tuple[int, ...]) -> Ints:
        """Return [3, rows] levels of attack, armor and shield upgrades that these upgrades give to each type."""
        levels = np.zeros((3, len(self.catalog.units)), np.int64)
        numbered = [u for u in map(self.catalog.upgrade, upgrades) if _LEVEL.search(u.name)]
        for unit in self.catalog.units:
            effects = {hit.effect for weapon in unit.weapons for hit in weapon.hits}
            levels[0, unit.row] = _count(numbered, "effect", effects, "Amount")
            levels[1, unit.row] = _count(numbered, "unit", {unit.name}, "LifeArmor")
            levels[2, unit.row] = _count(numbered, "unit", {unit.name}, "ShieldArmor")
        return levels

    @functools.lru_cache(maxsize=64)  # noqa: B019  # see above
    def levels_of(self, upgrades: tuple[tuple[int, ...], ...]) -> Ints:
        """Return [players, 3, rows] the levels that each player's upgrades give."""
        return np.stack([self.levels(mine) for mine in upgrades])


def _count(upgrades: Iterable[Upgrade], catalog: str, entries: set[str], field: str) -> int:
    return sum(
        any(c.catalog == catalog and c.entry in entries and c.field == field for c in upgrade.changes)
        for upgrade in upgrades
    )


@functools.cache
def types_of(catalog: Catalog) -> Types:
    """Return the arrays of a catalog."""
    return Types(catalog)


def _field_of_power(unit: UnitType) -> float:
    """Return the radius in which it powers structures; types that only hasten warping in have none."""
    return max(radius for radius, _ in unit.power) if unit.name in SUPPLIES else 0.0
