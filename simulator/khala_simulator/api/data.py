"""The answer to `data`: all abilities, unit types, upgrades, buffs and effects.

Numbers of units and upgrades come from the game's catalog; other facts of the API (names, targets, which ability stands
for which) from the tables in `data/api`. Lists are dense: the entry at index i has the id i, because PySC2 looks
abilities up by position.
"""

from __future__ import annotations

import csv
import functools
from importlib import resources
from typing import TYPE_CHECKING

from s2clientprotocol import common_pb2, data_pb2, sc2api_pb2

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.tables.catalog import Catalog, UnitType, Weapon

_PLANES = {"ground": data_pb2.Weapon.Ground, "air": data_pb2.Weapon.Air, "any": data_pb2.Weapon.Any}
_NORMAL_SECOND_LOOPS = 16


@functools.cache
def rows(name: str) -> list[dict[str, str]]:
    """Return the unchanged rows of a table of `data/api`; a blank means that the API leaves the field out."""
    path = resources.files("khala_simulator.data") / "api" / f"{name}.tsv"
    lines = path.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(lines, delimiter="\t", quoting=csv.QUOTE_NONE, restval=""))


def abilities(version: str) -> list[dict[str, str]]:
    """Return the rows of the abilities that a version of the game has; the first ids are the same in all."""
    return rows("abilities") + (rows("abilities_5") if version.startswith("5.") else [])


def answer(catalog: Catalog, request: sc2api_pb2.RequestData) -> sc2api_pb2.ResponseData:
    """Return the tables that a request asks for."""
    return sc2api_pb2.ResponseData(
        abilities=map(_ability, abilities(catalog.version)) if request.ability_id else (),
        units=_units(catalog) if request.unit_type_id else (),
        upgrades=_upgrades(catalog) if request.upgrade_id else (),
        buffs=map(_buff, rows("buffs")) if request.buff_id else (),
        effects=map(_effect, rows("effects")) if request.effect_id else (),
    )


def _ability(row: dict[str, str]) -> data_pb2.AbilityData:
    flags = row["flags"]
    data = data_pb2.AbilityData(
        ability_id=int(row["ability_id"]),
        link_name=row["link_name"],
        link_index=int(row["link_index"]),
        friendly_name=row["friendly_name"] or f"{row['link_name']}_{row['link_index']}",
        available="v" in flags,
        allow_minimap="m" in flags,
    )
    if row["button_name"]:
        data.button_name = row["button_name"]
    if row["remaps_to"]:
        data.remaps_to_ability_id = int(row["remaps_to"])
    if row["target"]:
        data.target = data_pb2.AbilityData.Target.Value(row["target"])
    if row["cast_range"]:
        data.cast_range = float(row["cast_range"])
    if row["footprint_radius"]:
        data.is_building = True
        data.footprint_radius = float(row["footprint_radius"])
    if "i" in flags:
        data.is_instant_placement = True
    if row["hotkey"]:
        data.hotkey = row["hotkey"]
    if "a" in flags:
        data.allow_autocast = True
    return data


def _units(catalog: Catalog) -> Iterable[data_pb2.UnitTypeData]:
    for row in rows("units"):
        data = data_pb2.UnitTypeData(
            unit_id=int(row["unit_id"]),
            name=row["name"],
            available="v" in row["flags"],
            has_minerals="m" in row["flags"],
            has_vespene="g" in row["flags"],
        )
        known = catalog.row_of_id.get(data.unit_id)
        if known is None:
            _describe_unknown(data, row)
        else:
            _describe(data, catalog.units[known])
            if catalog.units[known].like:  # each map numbers its own types
                data.name = catalog.units[known].name
        yield data


def _describe_unknown(data: data_pb2.UnitTypeData, row: dict[str, str]) -> None:
    data.race = common_pb2.Race.Value(row["race"] or "NoRace")
    data.attributes.extend(data_pb2.Attribute.Value(name) for name in filter(None, row["attributes"].split(",")))
    data.tech_alias.extend(int(alias) for alias in filter(None, row["tech_alias"].split(",")))
    if row["unit_alias"]:
        data.unit_alias = int(row["unit_alias"])


def _describe(data: data_pb2.UnitTypeData, unit: UnitType) -> None:
    data.race = common_pb2.Race.Value(unit.race.capitalize() if unit.race != "neutral" else "NoRace")
    data.attributes.extend(data_pb2.Attribute.Value(name.capitalize()) for name in unit.attributes)
    data.mineral_cost, data.vespene_cost = unit.cost
    data.food_required, data.food_provided = unit.supply, unit.provides
    data.cargo_size = unit.cargo_size
    data.build_time = unit.build_loops
    data.ability_id = unit.ability
    data.tech_requirement = unit.tech_requirement
    data.require_attached = unit.require_attached
    data.sight_range = unit.sight
    data.movement_speed = unit.speed_n
    data.armor = unit.armor
    if unit.unit_alias:
        data.unit_alias = unit.unit_alias
    if unit.tech_alias:
        data.tech_alias.extend(unit.tech_alias)
    data.weapons.extend(_weapon(weapon) for weapon in unit.weapons if not (weapon.hidden or weapon.disabled))


def _weapon(weapon: Weapon) -> data_pb2.Weapon:
    return data_pb2.Weapon(
        type=_PLANES[weapon.targets],
        damage=weapon.shown_damage,
        damage_bonus=[
            data_pb2.DamageBonus(attribute=data_pb2.Attribute.Value(name.capitalize()), bonus=bonus)
            for name, bonus in weapon.shown_bonus
        ],
        attacks=weapon.shown_attacks,
        range=weapon.range,
        speed=weapon.period_loops / _NORMAL_SECOND_LOOPS,
    )


def _upgrades(catalog: Catalog) -> Iterable[data_pb2.UpgradeData]:
    known = {upgrade.id: upgrade for upgrade in catalog.upgrades}
    for row in rows("upgrades"):
        data = data_pb2.UpgradeData(upgrade_id=int(row["upgrade_id"]), name=row["name"])
        if upgrade := known.get(data.upgrade_id):
            data.mineral_cost, data.vespene_cost = upgrade.cost
            data.research_time = upgrade.loops
            data.ability_id = upgrade.ability
        yield data


def _buff(row: dict[str, str]) -> data_pb2.BuffData:
    return data_pb2.BuffData(buff_id=int(row["buff_id"]), name=row["name"])


def _effect(row: dict[str, str]) -> data_pb2.EffectData:
    return data_pb2.EffectData(
        effect_id=int(row["effect_id"]),
        name=row["name"],
        friendly_name=row["friendly_name"],
        radius=float(row["radius"]),
    )
