"""The numbers of a player's units: each game has its own."""

from __future__ import annotations

from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.stats import CHANGED, Stats, new_stats

GROUND_WEAPONS = 39
"""Of a Protoss: the first level."""


def amounts(stats: Stats) -> list[list[list[tuple[float, object]]]]:
    """Return by player and weapon the damages of a shot."""
    return [[[(hit.amount, hit.bonus) for hit in hits] for hits in weapons] for weapons in stats.damage]


def test_upgrades_of_one_game_are_not_those_of_the_next() -> None:
    catalog = load_catalog()
    zealot = catalog.unit("Zealot")
    weapon = zealot.weapons[0].row
    first = new_stats(catalog, 3)
    before = amounts(first)
    first.apply(1, [GROUND_WEAPONS])
    first.life_max[1, zealot.row] = 1.0
    assert amounts(first)[1][weapon] != before[1][weapon]
    second, plain = new_stats(catalog, 3), Stats(catalog, 3)
    for name in CHANGED:
        assert (getattr(second, name) == getattr(plain, name)).all(), name
    assert amounts(second) == amounts(plain) == before
    assert second.with_upgrades(1, "unit", "Zealot", "LifeMax", 5.0) == 5.0
