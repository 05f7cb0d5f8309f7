from __future__ import annotations

import pytest

from khala_simulator.systems.weapons import CONDITIONS
from khala_simulator.tables.catalog import Catalog, CatalogError, load_catalog
from khala_simulator.tables.loader import read_data
from khala_simulator.tables.mechanics import MECHANICS, entries
from khala_simulator.tables.stats import ATTRIBUTES, LAYERS
from khala_simulator.tables.versions import DATA_SETS, DataSet

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


# period and scan range, damage, bonus against armored, range: Stalker and Colossus; life of a Hydralisk
OF_DATA: dict[DataSet, tuple[tuple[float, ...], tuple[float, ...], float]] = {
    "liberty": ((23.04, 5, 10, 4, 6), (35.2, 5, 20, 0, 6), 80),
    "void": ((23.04, 5, 10, 4, 6), (26.4, 5, 15, 0, 6), 80),
    "multi": ((29.92, 6.5, 13, 5, 6), (24, 7.5, 10, 0, 7), 90),
}


def numbers(catalog: Catalog, name: str) -> tuple[float, ...]:
    (weapon,) = catalog.unit(name).weapons
    hit = weapon.hits[-1]
    return weapon.period_loops, weapon.scan, hit.damage, dict(hit.bonus).get("armored", 0), weapon.range


@pytest.mark.parametrize("version", ["4.10", "5.0.13"])
@pytest.mark.parametrize("data", DATA_SETS)
def test_a_data_set_has_its_numbers_in_every_version(version: str, data: DataSet) -> None:
    catalog = load_catalog(version, data)
    found = numbers(catalog, "Stalker"), numbers(catalog, "Colossus"), catalog.unit("Hydralisk").life
    assert found == OF_DATA[data]
    assert numbers(catalog, "Stalker_RL") == found[0]  # a map's own type


# what a type can shoot at with the data of liberty, void and multi: g for ground, a for air; SOURCES.md of the tables
REACH = {
    "Tempest": (None, "a", "ga"),
    "HighTemplar": ("", "", "g"),
    "InfestorTerran": ("ga", "ga", "ga"),
    "Queen": ("ga", "ga", "ga"),
    "Cyclone": (None, "ga", "ga"),
}


@pytest.mark.parametrize("version", ["4.10", "5.0.13"])
@pytest.mark.parametrize("name", REACH)
def test_a_type_has_the_weapons_of_the_data_set(version: str, name: str) -> None:
    for data, planes in zip(DATA_SETS, REACH[name], strict=True):
        unit = load_catalog(version, data).unit(name)
        reach = [plane for plane in ("ground", "air") if unit.weapon_against(plane) is not None]
        assert planes in (None, "".join(plane[0] for plane in reach)), data


def test_an_infested_terran_has_one_rifle_against_all_before_the_multiplayer_gave_it_spines() -> None:
    def weapons(data: DataSet) -> dict[str, str]:
        return {weapon.id: weapon.targets for weapon in load_catalog(data=data).unit("InfestorTerran").weapons}

    assert weapons("liberty") == weapons("void") == {"InfestedGuassRifle": "any"}
    assert weapons("multi") == {"InfestedGuassRifle": "ground", "InfestedAcidSpines": "air"}


def test_a_catalog_is_loaded_once_for_a_version_and_data_set() -> None:
    assert load_catalog() is load_catalog("4.10", "multi") is load_catalog(75689)
    assert load_catalog(data="liberty") is load_catalog("4.10", "liberty")
    assert load_catalog(data="liberty") is not load_catalog()


@pytest.mark.parametrize("version", ["4.10", "5.0.13"])
@pytest.mark.parametrize("data", [data for data in DATA_SETS if data != "multi"])
def test_a_data_set_changes_rows_and_fields_that_are_there(version: str, data: DataSet) -> None:
    for kind, changes in read_data("tables", f"{data}.yaml").items():
        rows = {
            row.get("name" if kind == "units" else "id"): row
            for row in read_data("tables", version, f"{kind}.json")["rows"]
        }
        assert set(changes) <= set(rows)
        known = {field for row in rows.values() for field in row}
        for key, change in changes.items():
            assert set(change) <= known
            if isinstance(hits := change.get("hits"), dict):
                assert set(hits) <= {hit["effect"] for hit in rows[key]["hits"]}


@pytest.mark.parametrize("data", DATA_SETS)
def test_the_numbers_that_clients_see_of_a_weapon_are_those_of_its_hits(data: DataSet) -> None:
    """Apart from damage that is split, dealt by another effect than the one that is shown, or launched."""
    for weapon in load_catalog(data=data).weapons:
        if weapon.id in ("ParticleDisruptors", "ThermalLances", "Adept", "NeedleSpines", "LiberatorMissileLaunchers"):
            assert {(hit.damage, hit.bonus) for hit in weapon.hits} == {(weapon.shown_damage, weapon.shown_bonus)}


def test_only_these_data_sets_are_shipped() -> None:
    with pytest.raises(CatalogError, match="shipped are liberty, void, multi"):
        load_catalog(data="swarm")  # type: ignore[arg-type]  # as a caller might


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
    assert by_id["VolatileBurst"].estimates == ("structures are not acquired",)
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
