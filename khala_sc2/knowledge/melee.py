"""Which unit types occur in melee games.

The tables mark types that only campaigns, other maps or older versions have. A few of these count anyway: the
cocoons and eggs of melee units, and what hatches from them.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.tables.catalog import Catalog


@functools.cache
def melee_types(catalog: Catalog) -> frozenset[str]:
    """Return the tables' names of the types that occur in melee games."""
    marked = {unit.name for unit in catalog.units if not unit.not_in_melee}
    shells = {
        str(ability.numbers[shell])
        for name in marked
        for ability in catalog.abilities_of(catalog.row_of_name[name])
        for shell in ("cocoon", "egg")
        if shell in ability.numbers
    }
    found = set(marked)
    new = shells - marked
    while new:
        found |= new
        new = _products(new, catalog) - found
    return frozenset(found)


def _products(names: Iterable[str], catalog: Catalog) -> set[str]:
    cards = (catalog.abilities_of(catalog.row_of_name[name]) for name in names)
    return {ability.unit for card in cards for ability in card if ability.unit in catalog.row_of_name}
