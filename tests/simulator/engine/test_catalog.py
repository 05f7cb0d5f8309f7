from __future__ import annotations

import pytest

from khala_simulator.systems.weapons import CONDITIONS
from khala_simulator.tables.catalog import Catalog, CatalogError, load_catalog
from khala_simulator.tables.mechanics import MECHANICS, entries
from khala_simulator.tables.stats import ATTRIBUTES, LAYERS

# read off the 4.10 game: life, shields, armor, speed per normal second, sight, supply, minerals, vespene
UNITS_4_10 = {
    "Stalker": (80, 80, 1, 2.9531, 10, 2, 125, 50),
    "Zealot": (100, 50, 1, 2.25, 9, 2, 100, 0),
    "Colossus": (200, 150, 1, 2.25, 10, 6, 300, 200),
    "Zergling": (35, 0, 0, 2.9531, 8, 0.5, 25, 0),
    "SpineCrawler": (300, 0, 2, 0, 11, 0, 150, 0),
    "Marine": (45, 0, 0, 2.25, 9, 1, 50, 0),
}


@pytest.fixture(params=["4.10", "5.0.13"])
def catalog(request: pytest.FixtureRequest) -> Catalog:
    return load_catalog(request.param)


@pytest.mark.parametrize("name", UNITS_4_10)
def test_a_unit_has_its_numbers(name: str) -> None:
    u = load_catalog().unit(name)
    numbers = (u.life, u.shields, u.armor, u.speed_n, u.sight, u.supply, *u.cost)
    assert numbers == UNITS_4_10[name]


def test_tables_are_found_by_version_and_by_build() -> None:
    assert load_catalog("4.10") is not load_catalog("5.0.13")
    assert load_catalog(75689).version == "4.10"
    assert load_catalog(92440).build == 92440


@pytest.mark.parametrize("version", ["4.9", 1, "", "../4.10"])
def test_a_version_without_tables_is_refused(version: str | int) -> None:
    with pytest.raises(CatalogError, match=r"shipped are 4.10 \(build 75689\), 5.0.13 \(build 92440\)"):
        load_catalog(version)


@pytest.mark.parametrize("key", ["Stalkr", 999999])
def test_an_unknown_unit_or_upgrade_is_refused(key: str | int) -> None:
    catalog = load_catalog()
    with pytest.raises(CatalogError, match="no unit type"):
        catalog.unit(key)
    with pytest.raises(CatalogError, match="no upgrade"):
        catalog.upgrade(key)


def test_every_unit_of_the_version_is_there_and_sound(catalog: Catalog) -> None:
    assert len(catalog.units) >= 269
    assert len({u.id for u in catalog.units}) == len({u.name for u in catalog.units}) == len(catalog.units)
    for row, unit in enumerate(catalog.units):
        assert unit.row == row
        assert catalog.unit(unit.id) is catalog.unit(unit.name) is unit
        assert unit.life > 0
        assert unit.race in ("protoss", "terran", "zerg", "neutral")
        assert set(unit.attributes) <= set(ATTRIBUTES)
        assert set(unit.collide) <= set(LAYERS)
        assert not unit.footprint or unit.footprint in catalog.footprints


def test_every_weapon_is_sound(catalog: Catalog) -> None:
    used = {w.id for u in catalog.units for w in u.weapons}
    assert used == {w.id for w in catalog.weapons}
    for row, weapon in enumerate(catalog.weapons):
        assert weapon.row == row
        assert weapon.targets in ("ground", "air", "any")
        assert weapon.jitter_loops[0] <= 0 <= weapon.jitter_loops[1]
        for hit in weapon.hits:
            assert hit.damage >= 0
            assert all(name in ATTRIBUTES for name, _ in hit.bonus)


def test_a_weapon_says_which_of_its_numbers_are_estimates() -> None:
    by_id = {w.id: w for w in load_catalog().weapons}
    assert by_id["ImpalerTentacle"].estimates == ("missile speed",)
    assert by_id["ParticleDisruptors"].estimates == ()


@pytest.mark.parametrize("version", ["4.10", "5.0.13"])
def test_every_condition_of_a_hit_is_known_or_never_holds(version: str) -> None:
    """Those that never hold: a lowered depot, and which side a Cyclone fires from; the other branch is the same."""
    named = {hit.when for weapon in load_catalog(version).weapons for hit in weapon.hits} - {"", "else"}
    assert named - set(CONDITIONS) <= {"unknown", "IsSupplyDepotLowered", "CycloneWeaponLaunchMissileAlternate"}


def test_ids_are_those_of_the_version() -> None:
    assert load_catalog("4.10").unit("AssimilatorRich").id == 1955
    assert load_catalog("5.0.13").unit("AssimilatorRich").id == 1994


def test_a_structure_is_shown_with_the_radius_of_its_footprint() -> None:
    spine = load_catalog().unit("SpineCrawler")
    assert (spine.radius, spine.radius_shown) == (0.875, 1.125)


def test_a_footprint_lists_its_cells_around_its_centre() -> None:
    catalog = load_catalog()
    nexus = catalog.footprints[catalog.unit("Nexus").footprint]
    assert nexus.size == (5, 5)
    assert len(nexus.cells) == 21  # 5 x 5 without its corners
    assert (-2, -2) not in nexus.cells


def test_every_constant_says_where_it_is_from() -> None:
    found = {e.name: e for e in entries()}
    assert {e.source for e in found.values()} <= {"catalog", "replay", "estimate"}
    assert all(e.unit and e.note for e in found.values())
    assert found["damage_min"].value == MECHANICS.damage_min == 0.5
    assert found["leash_radius"].source == "catalog"
    assert found["push_firm"].source == "estimate"
