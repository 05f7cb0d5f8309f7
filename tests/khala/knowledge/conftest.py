"""The simulator's tables next to the facts that agents read, for each version of the game."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_bridge.compat import units, upgrades
from khala_bridge.knowledge import VERSIONS
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.tables.catalog import Catalog

RACES = (units.Neutral, units.Protoss, units.Terran, units.Zerg)
UNITS = {int(member): member.name for race in RACES for member in race}
UPGRADES = {int(member): member.name for member in upgrades.Upgrades}


@pytest.fixture(params=VERSIONS)
def version(request: pytest.FixtureRequest) -> str:
    """Return each version of the game that has facts."""
    return str(request.param)


@pytest.fixture
def tables(version: str) -> Catalog:
    """Return the simulator's tables of that version."""
    return load_catalog(version)


@pytest.fixture
def names() -> dict[str, str]:
    """Return PySC2's names of unit types and upgrades by the tables' names; its numbers are those of 4.10."""
    old = load_catalog("4.10")
    named = {unit.name: UNITS[unit.id] for unit in old.units if unit.id in UNITS and not unit.like}
    return named | {upgrade.name: UPGRADES[upgrade.id] for upgrade in old.upgrades if upgrade.id in UPGRADES}


@pytest.fixture
def table_names(names: dict[str, str]) -> Callable[[str], str]:
    """Return a function from the bridge's name to the tables' name."""
    back = {ours: own for own, ours in names.items()}
    return lambda name: back.get(name, name)
