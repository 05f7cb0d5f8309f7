"""The facts that agents read about unit types are those that the simulator plays by."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.knowledge import WeaponFacts, knowledge

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.knowledge import UnitFacts
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType as Row
    from khala_simulator.tables.records import Weapon as WeaponRow

FASTER = 22.4 / 16  # "normal" seconds in a second
WEAPONS_OF_THEIR_OWN = {"Carrier", "Battlecruiser", "Baneling", "BroodlingEscort", "LocustFlying"}


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        ("id", lambda row: row.id),
        ("race", lambda row: row.race),
        ("structure", lambda row: row.structure),
        ("worker", lambda row: row.worker),
        ("attributes", lambda row: tuple(sorted(row.attributes))),
        ("flying", lambda row: row.flying),
        ("planes", lambda row: row.planes),
        ("burrowed", lambda row: row.burrowed),
        ("cloaked", lambda row: row.cloaked and not row.burrowed),
        ("health", lambda row: row.life),
        ("shield", lambda row: row.shields),
        ("energy", lambda row: row.energy),
        ("energy_start", lambda row: row.energy_start),
        ("armor", lambda row: row.armor),
        ("sight", lambda row: row.sight),
        ("detects", lambda row: row.detect),
        ("radius", lambda row: row.radius),
        ("supply", lambda row: row.supply),
        ("provides", lambda row: row.provides),
        ("minerals", lambda row: row.cost[0]),
        ("vespene", lambda row: row.cost[1]),
        ("cargo_size", lambda row: row.cargo_size),
        ("cargo_space", lambda row: row.cargo_space),
        ("resource", lambda row: row.resource),
        ("needs_power", lambda row: row.needs_power),
        ("needs_creep", lambda row: row.needs_creep),
        ("makes_creep", lambda row: row.makes_creep),
        ("power_radius", lambda row: max((radius for radius, _ in row.power), default=0)),
    ],
)
def test_a_fact_is_that_of_the_tables(
    field: str,
    expected: Callable[[Row], Any],
    version: str,
    tables: Catalog,
    table_names: Callable[[str], str],
) -> None:
    told = {name: getattr(kind, field) for name, kind in knowledge(version).items()}
    assert told == {name: expected(tables.unit(table_names(name))) for name in told}


def test_types_of_melee_games_are_those_that_the_tables_mark_and_what_these_pass_through(
    version: str, tables: Catalog, table_names: Callable[[str], str]
) -> None:
    told = {name: kind.melee for name, kind in knowledge(version).items()}
    marked = {name: not tables.unit(table_names(name)).not_in_melee for name in told}
    infested = {"InfestedTerran", "InfestedTerranBurrowed", "InfestedTerranCocoon"}
    passed = {"4.10": {"BanelingCocoon", *infested}, "5.0.13": {"BanelingCocoon"}}[version]
    assert told == marked | dict.fromkeys(passed, True)


def test_speeds_are_per_second_of_the_games_clock(
    version: str, tables: Catalog, table_names: Callable[[str], str]
) -> None:
    speeds = {name: kind.speed for name, kind in knowledge(version).items()}
    rows = {name: tables.unit(table_names(name)) for name in speeds}
    assert speeds == pytest.approx({name: row.speed_n * FASTER for name, row in rows.items()}, abs=0.006)


def test_what_a_type_can_be_told_is_its_command_card(
    version: str, tables: Catalog, table_names: Callable[[str], str]
) -> None:
    told = {name: kind.ability_ids for name, kind in knowledge(version).items()}
    cards = {name: tables.abilities_of(tables.unit(table_names(name)).row) for name in told}
    assert told == {name: tuple(ability.id for ability in card) for name, card in cards.items()}


def test_a_footprint_has_as_many_cells_each_way_as_the_mask(
    version: str, tables: Catalog, table_names: Callable[[str], str]
) -> None:
    for name, kind in knowledge(version).items():
        mask = tables.footprints.get(tables.unit(table_names(name)).footprint)
        columns = {x for x, _ in mask.cells} if mask else set()
        rows = {y for _, y in mask.cells} if mask else set()
        assert (kind.footprint or (0, 0)) == (len(columns), len(rows)), name


def test_a_type_stands_in_for_its_technical_aliases(
    version: str, tables: Catalog, table_names: Callable[[str], str]
) -> None:
    for name, kind in knowledge(version).items():
        aliases = tables.unit(table_names(name)).tech_alias
        known = {number for number in aliases if number in tables.row_of_id}
        assert {tables.unit(table_names(other)).id for other in kind.counts_as} == known, name


def test_producers_can_be_told_to_make_it_and_it_takes_as_long_as_they_need(
    version: str, tables: Catalog, table_names: Callable[[str], str]
) -> None:
    made = [kind for kind in knowledge(version).values() if kind.producers]
    assert len(made) > 150
    for kind in made:
        ways = {(way.producer, way.ability): way for way in tables.unit(table_names(kind.name)).made_by}
        for producer in kind.producers:
            row = tables.unit(table_names(producer))
            card = {ability.id for ability in tables.abilities_of(row.row)}
            mine = {ability for own, ability in ways if own == row.name}
            assert mine & card & set(kind.made_by), (kind.name, producer)
        first = next(way for way in ways.values() if way.ability == kind.made_by[0])
        assert kind.build_s == pytest.approx(first.loops / 22.4, abs=0.006), kind.name


def test_units_that_are_trained_built_or_warped_in_have_a_producer(
    version: str, tables: Catalog, names: dict[str, str]
) -> None:
    kinds = {"train", "build", "warp_in", "build_addon"}
    products = {a.unit for a in tables.abilities if a.effect in kinds and a.users} & names.keys()
    assert {names[product] for product in products if not knowledge(version)[names[product]].producers} == set()


def _told(weapon: WeaponFacts) -> tuple[Any, ...]:
    return (weapon.targets, weapon.range, weapon.min_range, weapon.damage, weapon.attacks, weapon.bonus)


def _shown(row: WeaponRow, usable: list[WeaponRow]) -> tuple[Any, ...]:
    filled = any(other.hidden and other.targets == row.targets and not other.min_range for other in usable)
    nearest = 0 if filled else row.min_range
    return (row.targets, row.range, nearest, row.shown_damage, row.shown_attacks, dict(row.shown_bonus))


def test_weapons_are_those_that_the_api_tells(version: str, tables: Catalog, table_names: Callable[[str], str]) -> None:
    for name, kind in knowledge(version).items():
        usable = [w for w in tables.unit(table_names(name)).weapons if w.works and not w.disabled]
        rows = [w for w in usable if not w.hidden] or usable
        if name in WEAPONS_OF_THEIR_OWN:
            continue
        assert [_told(weapon) for weapon in kind.weapons] == [_shown(row, usable) for row in rows], name
        assert [w.period_s for w in kind.weapons] == pytest.approx([r.period_loops / 22.4 for r in rows], abs=0.006)
        rings = [max((ring.radius for hit in row.hits for ring in hit.area), default=0) for row in rows]
        assert [weapon.splash for weapon in kind.weapons] == rings, name


@pytest.mark.parametrize(
    ("name", "weapons"),
    [
        ("Carrier", [("any", 8, 0, 5, 16, {})]),  # eight Interceptors with two beams each
        ("Battlecruiser", [("ground", 6, 0, 8, 1, {}), ("air", 6, 0, 5, 1, {})]),
        ("Baneling", [("ground", 0.25, 0, 20, 1, {"light": 15, "structure": 60})]),
        ("BroodlingEscort", []),  # its hit is listed with the Brood Lord
        ("LocustFlying", []),
        ("Oracle", []),  # until it is switched on
    ],
)
def test_weapons_that_the_api_hides_are_told_as_they_work(name: str, weapons: list[tuple[Any, ...]]) -> None:
    assert [_told(weapon) for weapon in knowledge()[name].weapons] == weapons


def _value(kind: UnitFacts) -> float:
    return kind.minerals + kind.vespene


def test_a_morphed_type_is_worth_what_it_was_made_of_and_what_was_added() -> None:
    known = knowledge()
    assert _value(known["BroodLord"]) == _value(known["Corruptor"]) + 150 + 150
    assert _value(known["Hive"]) == _value(known["Lair"]) + 200 + 150
