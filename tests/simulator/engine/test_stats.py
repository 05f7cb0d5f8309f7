"""The numbers of a player's units: each game has its own."""

from __future__ import annotations

import numpy as np

from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.stats import Stats, new_stats

GROUND_WEAPONS = 39
"""Of a Protoss: the first level."""


def test_upgrades_of_one_game_are_not_those_of_the_next() -> None:
    catalog = load_catalog()
    zealot = catalog.unit("Zealot")
    weapon = zealot.weapons[0].row
    first = new_stats(catalog, 3)
    before = first.damage[1][weapon]
    first.apply(1, [GROUND_WEAPONS])
    first.life_max[1, zealot.row] = 1.0
    assert first.damage[1][weapon] != before
    second, plain = new_stats(catalog, 3), Stats(catalog, 3)
    assert second.damage[1][weapon] == before
    for name, part in vars(plain).items():
        if isinstance(part, np.ndarray):
            assert (getattr(second, name) == part).all(), name
    assert second.damage == plain.damage
    assert second.with_upgrades(1, "unit", "Zealot", "LifeMax", 5.0) == 5.0
