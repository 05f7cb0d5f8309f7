"""Upgrades of Terran units and structures, against what the tables of both versions change."""

from __future__ import annotations

from typing import Any

import pytest

from khala_simulator.combat import damage

VERSIONS = ("4.10", "5.0.13")


@pytest.fixture(params=VERSIONS)
def field(request: pytest.FixtureRequest, make_field: Any) -> Any:
    return make_field(version=request.param)


@pytest.mark.parametrize("weapon", ["LongboltMissile", "TwinIbiksCannon", "AutoTurret"])
def test_hi_sec_auto_tracking_adds_range(field: Any, weapon: str) -> None:
    world = field.world
    row = next(w.row for w in world.catalog.weapons if w.id == weapon)
    before = world.stats.range[1, row]
    field.research(1, "HiSecAutoTracking")
    assert world.stats.range[1, row] == before + 1
    assert world.stats.range[2, row] == before


@pytest.mark.parametrize("name", ["CommandCenter", "Bunker", "MissileTurret", "SupplyDepotLowered", "AutoTurret"])
def test_structure_armor_adds_what_the_tables_say(field: Any, name: str) -> None:
    world = field.world
    row = world.catalog.unit(name).row
    before = world.stats.armor[1, row]
    field.research(1, "TerranBuildingArmor")
    changes = world.catalog.upgrade("TerranBuildingArmor").changes
    more = sum(float(c.value) for c in changes if c.entry == name and c.field == "LifeArmor")
    assert world.stats.armor[1, row] == before + more
    assert more == 2 or name == "AutoTurret"


@pytest.mark.parametrize(
    ("upgrade", "name", "column", "more"),
    [("BansheeSpeed", "Banshee", "step", 1 / 16), ("TerranVehicleAndShipArmorsLevel1", "Raven", "armor", 1),
     ("TerranVehicleAndShipArmorsLevel1", "VikingAssault", "armor", 1)],
)  # fmt: skip
def test_upgrades_change_the_numbers_of_units(field: Any, upgrade: str, name: str, column: str, more: float) -> None:
    world = field.world
    at = 1, world.catalog.unit(name).row
    before = getattr(world.stats, column)[at]
    field.research(1, upgrade)
    assert getattr(world.stats, column)[at] == pytest.approx(before + more)


@pytest.mark.parametrize(
    ("version", "upgrade", "name"),
    [("4.10", "RavenCorvidReactor", "Raven"), ("5.0.13", "RavenCorvidReactor", "Raven"),
     ("4.10", "GhostMoebiusReactor", "Ghost")],
)  # fmt: skip
def test_reactors_let_casters_start_with_more_energy(make_field: Any, version: str, upgrade: str, name: str) -> None:
    field = make_field(version=version)
    start = field.world.catalog.unit(name).energy_start
    assert field.world.energy[field.put(name, 1, 10, 10)] == start
    field.research(1, upgrade)
    assert field.world.energy[field.put(name, 1, 12, 10)] == start + 25


def test_infernal_flames_burn_light_units_more(field: Any) -> None:
    world = field.world
    row = next(w.row for w in world.catalog.weapons if w.id == "InfernalFlameThrower")
    before = damage.amount_against(world.stats.damage[1][row][0], 1)
    field.research(1, "HighCapacityBarrels")
    change = next(c for c in world.catalog.upgrade("HighCapacityBarrels").changes if c.entry == "InfernalFlameThrower")
    assert damage.amount_against(world.stats.damage[1][row][0], 1) == before + float(change.value)
