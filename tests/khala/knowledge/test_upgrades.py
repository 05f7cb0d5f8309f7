"""The facts that agents read about upgrades and buffs are those that the simulator plays by."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_bridge.knowledge import abilities, buffs, knowledge, upgrades
from khala_simulator.tables.stats import ATTRIBUTES, Stats

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.knowledge import UpgradeFacts
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import UnitType

WITHOUT, WITH = 0, 1
"""Two players, one with the upgrade."""


def test_prices_times_and_places_are_those_of_the_research(
    version: str, tables: Catalog, names: dict[str, str], table_names: Callable[[str], str]
) -> None:
    for name, known in upgrades(version).items():
        row = tables.upgrade(table_names(name))
        assert (known.id, known.melee) == (row.id, row.researchable), name
        if known.melee:
            research = tables.ability(known.ability)
            assert (research.effect, research.upgrade) == ("research", row.name), name
            assert (known.minerals, known.vespene) == (research.minerals, research.vespene), name
            assert known.at == tuple(names[place] for place in research.users), name
            assert known.time_s == pytest.approx(research.loops / 22.4, abs=0.006), name
            assert set(row.at) <= set(research.users), name


def test_where_the_tables_have_a_price_of_the_upgrade_too_both_agree(
    version: str, tables: Catalog, table_names: Callable[[str], str]
) -> None:
    prices = {name: [known.minerals, known.vespene] for name, known in upgrades(version).items() if known.melee}
    others = {name: [float(part) for part in tables.upgrade(table_names(name)).cost] for name in prices}
    differing = {name for name, price in prices.items() if price != others[name]}
    assert differing == {"4.10": {"InfernalPreigniter"}, "5.0.13": set()}[version]


@pytest.mark.parametrize(("name", "place"), [("LurkerRange", "LurkerDen"), ("AdvancedBallistics", "FusionCore")])
def test_an_upgrade_that_has_moved_is_researched_only_at_its_new_place(name: str, place: str) -> None:
    known = upgrades("5.0.13")[name]
    assert known.at == (place,)
    research = [ability for ability in abilities("5.0.13").values() if ability.researches == name]
    assert [ability.id for ability in research if ability.melee] == [known.ability]


def test_every_upgrade_that_can_be_researched_is_known(version: str, tables: Catalog, names: dict[str, str]) -> None:
    researchable = {names.get(row.name, row.name) for row in tables.upgrades if row.researchable}
    assert researchable == {name for name, known in upgrades(version).items() if known.melee}


def test_an_upgrade_requires_what_its_research_requires_and_enables_what_requires_it(version: str) -> None:
    for name, known in upgrades(version).items():
        research = abilities(version).get(known.ability)
        if known.melee:
            assert research is not None
            assert known.requires == research.requires, name
        enabled = {
            a.id for a in abilities(version).values() if name in a.requires and a.does not in ("research", "general")
        }
        assert {number for number in known.enables if number in abilities(version)} == enabled, name


def _played(stats: Stats, unit: UnitType) -> dict[str, float]:
    """Return what an upgrade changes for a type in the simulator's own rules, in our words."""
    columns = {
        "health": stats.life_max,
        "armor": stats.armor,
        "shield_armor": stats.shield_armor,
        "energy_start": stats.energy_start,
        "speed": stats.step * 22.4,
    }
    found = {field: column[WITH, unit.row] - column[WITHOUT, unit.row] for field, column in columns.items()}
    for weapon in unit.weapons:
        found["range"] = found.get("range", 0) or stats.range[WITH, weapon.row] - stats.range[WITHOUT, weapon.row]
        if weapon.period_loops:
            faster = stats.period[WITHOUT, weapon.row] / stats.period[WITH, weapon.row] - 1
            found["attack_speed"] = found.get("attack_speed", 0) or faster
    return {field: value for field, value in found.items() if abs(value) > 1e-9}


def _hurts_more(stats: Stats, unit: UnitType) -> set[float]:
    """Return by how much hits of a type grow, on plain targets and on each attribute."""
    found = set()
    for weapon in unit.weapons:
        pairs = zip(stats.damage[WITHOUT][weapon.row], stats.damage[WITH][weapon.row], strict=True)
        for before, after in pairs:
            found.add(after.amount - before.amount)
            old, new = dict(before.bonus), dict(after.bonus)
            found |= {new[bit] - old.get(bit, 0) for bit in new}
    return {round(value, 4) for value in found if value}


@pytest.mark.parametrize("half", range(2))
def test_changes_are_what_the_rules_make_of_the_upgrade(
    half: int, version: str, tables: Catalog, names: dict[str, str], table_names: Callable[[str], str]
) -> None:
    stats, compared = Stats(tables, 2), 0
    known = list(upgrades(version).values())[half::2]
    types = [unit for unit in tables.units if unit.name in names and not unit.like]
    for upgrade in known:
        stats.apply(WITH, [tables.upgrade(table_names(upgrade.name)).id])
        for unit in types:
            told = upgrade.changes.get(names[unit.name], {})
            plain = {field: value for field, value in told.items() if "damage" not in field}
            assert plain == pytest.approx(_played(stats, unit), abs=0.006), (upgrade.name, unit.name)
            assert {v for f, v in told.items() if "damage" in f} <= _hurts_more(stats, unit), (upgrade.name, unit.name)
            compared += len(told)
    assert compared > 150


def test_who_is_affected_exists_and_is_better_off(version: str) -> None:
    for name, known in upgrades(version).items():
        assert set(known.affects) <= knowledge(version).keys(), name
        assert known.changes.keys() <= set(known.affects), name
        assert all(_attribute(field) in (*ATTRIBUTES, None) for own in known.changes.values() for field in own), name


def _attribute(field: str) -> str | None:
    return field.partition("_against_")[2] or None


def test_levels_of_an_upgrade_require_the_one_before() -> None:
    def levels(known: UpgradeFacts) -> bool:
        return known.melee and known.name[-1] in "23" and "Level" in known.name

    raised = [known for known in upgrades().values() if levels(known)]
    assert len(raised) == 30
    for known in raised:
        assert f"{known.name[:-1]}{int(known.name[-1]) - 1}" in known.requires


def test_buffs_are_those_of_the_tables(version: str, tables: Catalog) -> None:
    for name, known in buffs(version).items():
        row = tables.buff(name)
        assert known.id == row.id
        assert known.duration_s == pytest.approx(row.loops / 22.4, abs=0.006), name
        assert (known.speed, known.attack_rate) == pytest.approx((row.speed, row.attack_rate), abs=1e-4), name
        assert known.work_rate == pytest.approx(0 if known.stops_work else row.work_rate, abs=1e-4) or known.stops_work
        assert set(known.flags) == row.flags, name
    assert {row.name for row in tables.buffs if row.id and row.name not in buffs(version)} == set()
