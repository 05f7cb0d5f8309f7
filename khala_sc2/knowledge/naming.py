"""The names that the bridge uses where they differ from the simulator's tables: PySC2's.

PySC2's numbers are those of version 4.10, so names are found by number in the tables of that version and carried over
to other versions by the tables' own names, which stay. A thing without a PySC2 name keeps the one of the tables.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Final

from khala_bridge import names
from khala_bridge.catalogue.functions import functions
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability

PYSC2_VERSION: Final = "4.10"
"""Version of the game whose numbers PySC2's tables have."""


@functools.cache
def unit_names() -> dict[str, str]:
    """Return PySC2's name of a unit type by the tables' name, without types that PySC2 does not have."""
    found = {unit.name: names.unit_name(unit.id) for unit in load_catalog(PYSC2_VERSION).units if not unit.like}
    return {own: name for own, name in found.items() if not _made_up(name)}


@functools.cache
def upgrade_names() -> dict[str, str]:
    """Return PySC2's name of an upgrade by the tables' name, without upgrades that PySC2 does not have."""
    found = {upgrade.name: names.upgrade_name(upgrade.id) for upgrade in load_catalog(PYSC2_VERSION).upgrades}
    return {own: name for own, name in found.items() if not _made_up(name)}


@functools.cache
def _stems() -> dict[int, str]:
    return {function.ability_id: function.stem for function in functions().values() if function.ability_id}


def unit_name(name: str) -> str:
    """Return the bridge's name for a type of the tables; one that is newer than PySC2 keeps its name."""
    return unit_names().get(name, name)


def table_name(unit_type: str) -> str:
    """Return the tables' name for a unit type; the inverse of `unit_name`."""
    return _table_names().get(unit_type, unit_type)


@functools.cache
def _table_names() -> dict[str, str]:
    return {ours: own for own, ours in unit_names().items()}


def upgrade_name(name: str) -> str:
    """Return the bridge's name for an upgrade of the tables; one that is newer than PySC2 keeps its name."""
    return upgrade_names().get(name, name)


def ability_name(ability: Ability) -> str:
    """Return the name that PySC2's functions have for an ability, without its arguments: `Effect_Blink_Stalker`."""
    return _stems().get(ability.id, ability.name.replace(" ", "_"))


def _made_up(name: str) -> bool:
    """Return whether `khala_bridge.names` had no name for a number and made one of it."""
    return name.removeprefix("Unit").isdigit() or name.removeprefix("Upgrade").isdigit()
