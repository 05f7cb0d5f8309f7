"""The tables that clients load at the start of a game."""

import pytest
from s2clientprotocol import data_pb2, sc2api_pb2

from khala_simulator.api import data
from khala_simulator.tables.catalog import load_catalog


@pytest.fixture(scope="module")
def tables() -> sc2api_pb2.ResponseData:
    everything = sc2api_pb2.RequestData(
        ability_id=True, unit_type_id=True, upgrade_id=True, buff_id=True, effect_id=True
    )
    return data.answer(load_catalog(), everything)


def test_abilities_stand_at_the_index_that_is_their_id(tables: sc2api_pb2.ResponseData) -> None:
    assert [ability.ability_id for ability in tables.abilities] == list(range(len(tables.abilities)))


def test_unit_types_stand_at_the_index_that_is_their_id(tables: sc2api_pb2.ResponseData) -> None:
    assert [unit.unit_id for unit in tables.units] == list(range(len(tables.units)))


def test_every_unit_type_of_the_catalog_is_told(tables: sc2api_pb2.ResponseData) -> None:
    renumbered_after_4_10 = 1943
    for unit in load_catalog().units:
        if unit.id < renumbered_after_4_10:
            assert tables.units[unit.id].name == unit.name


@pytest.mark.parametrize(
    ("specific", "general", "target"),
    [
        (4, 3665, "None"),
        (16, 3794, "PointOrUnit"),
        (18, 3793, "None"),
        (23, 3674, "PointOrUnit"),
        (1442, 3687, "Point"),
    ],
)
def test_specific_abilities_name_their_general_one(
    tables: sc2api_pb2.ResponseData, specific: int, general: int, target: str
) -> None:
    ability = tables.abilities[specific]
    assert ability.remaps_to_ability_id == general
    assert ability.target == data_pb2.AbilityData.Target.Value(target)


def test_hotkeys_placements_and_autocast_are_the_games(tables: sc2api_pb2.ResponseData) -> None:
    blink, tech_lab, repair, nexus = (tables.abilities[number] for number in (1442, 3682, 316, 880))
    assert (blink.hotkey, nexus.hotkey, tables.abilities[4].hotkey) == ("B", "BN", "S")
    assert (tech_lab.is_instant_placement, tech_lab.footprint_radius) == (True, 3.5)
    assert (repair.allow_autocast, blink.allow_autocast) == (True, False)
    assert (nexus.footprint_radius, nexus.is_building, nexus.is_instant_placement) == (2.5, True, False)
    assert [a.ability_id for a in tables.abilities if a.is_instant_placement and not a.is_building]  # such as rallies


def test_the_abilities_of_5_0_13_are_found_by_their_numbers() -> None:
    catalog = load_catalog("5.0.13")
    told = data.answer(catalog, sc2api_pb2.RequestData(ability_id=True)).abilities
    assert [ability.ability_id for ability in told] == list(range(len(told)))
    assert (told[4107].link_name, told[4107].friendly_name) == ("BatteryOvercharge", "Effect BatteryOvercharge")
    assert all(told[a.id].link_name == a.link for a in catalog.abilities if a.id > 3796)
    assert len(data.answer(load_catalog(), sc2api_pb2.RequestData(ability_id=True)).abilities) == 3797


def test_a_stalker_is_described_by_the_numbers_of_4_10(tables: sc2api_pb2.ResponseData) -> None:
    stalker = tables.units[74]
    assert (stalker.mineral_cost, stalker.vespene_cost, stalker.food_required) == (125, 50, 2)
    assert stalker.movement_speed == pytest.approx(2.9531)
    assert list(stalker.attributes) == [data_pb2.Armored, data_pb2.Mechanical]
    (weapon,) = stalker.weapons
    assert (weapon.type, weapon.damage, weapon.attacks, weapon.range) == (data_pb2.Weapon.Any, 13, 1, 6)
    assert weapon.speed == pytest.approx(1.87)
    assert [(bonus.attribute, bonus.bonus) for bonus in weapon.damage_bonus] == [(data_pb2.Armored, 5)]


@pytest.mark.parametrize("flag", ["ability_id", "unit_type_id", "upgrade_id", "buff_id", "effect_id"])
def test_only_what_is_asked_for_is_told(flag: str) -> None:
    answer = data.answer(load_catalog(), sc2api_pb2.RequestData(**{flag: True}))
    told = {field.name for field, _ in answer.ListFields()}
    wanted = {"ability_id": "abilities", "unit_type_id": "units", "upgrade_id": "upgrades", "buff_id": "buffs",
              "effect_id": "effects"}  # fmt: skip
    assert told == {wanted[flag]}
