"""Facts of unit types, from the simulator's tables.

A record has what the API says about a type, with its names, and what it does not say: where a type comes from, what
stands in for it, and the weapons that the game hides from clients (`_weapons`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from khala_sc2.knowledge.abilities import needs_of
from khala_sc2.knowledge.measures import per_second, plain, seconds, sparse
from khala_sc2.knowledge.melee import melee_types
from khala_sc2.knowledge.naming import unit_name, unit_names

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import Hit, ProductionRecord, UnitType, Weapon


_MELEE_RANGE: Final = 0.1
"""A gap between two weapons of one unit that is no gap in play."""


def unit_facts(catalog: Catalog) -> dict[str, dict[str, Any]]:
    """Return one record for each type that PySC2 has a name for, by that name, in alphabetical order."""
    known = [unit for unit in catalog.units if not unit.like and unit.name in unit_names()]
    known.sort(key=lambda unit: unit_name(unit.name))
    return {unit_name(unit.name): sparse(_unit(unit, catalog)) for unit in known}


def _unit(unit: UnitType, catalog: Catalog) -> dict[str, Any]:
    return {
        "id": unit.id,
        "race": unit.race,
        "melee": unit.name in melee_types(catalog),
        "structure": unit.structure,
        "attributes": sorted(unit.attributes),
        "flying": unit.flying,
        "planes": list(unit.planes),
        "health": plain(unit.life),
        "shield": plain(unit.shields),
        "energy": plain(unit.energy),
        "energy_start": plain(unit.energy_start),
        "armor": plain(unit.armor),
        "speed": per_second(unit.speed_n),
        "creep": plain(unit.creep_factor) if unit.speed_n and unit.creep_factor != 1 else 0,
        "sight": plain(unit.sight),
        "detects": plain(unit.detect),
        "radius": plain(unit.radius),
        "cloaked": unit.cloaked and not unit.burrowed,
        "burrowed": unit.burrowed,
        "worker": unit.worker,
        **_economy(unit),
        **_origin(unit, catalog),
        **_ground(unit, catalog),
        "counts_as": [
            unit_name(catalog.unit(number).name) for number in unit.tech_alias if number in catalog.row_of_id
        ],
        "ability_ids": [ability.id for ability in catalog.abilities_of(unit.row)],
        "weapons": [sparse(weapon) for weapon in _weapons(unit, catalog)],
    }


def _economy(unit: UnitType) -> dict[str, Any]:
    minerals, vespene = unit.cost
    return {
        "supply": plain(unit.supply),
        "provides": plain(unit.provides),
        "minerals": plain(minerals),
        "vespene": plain(vespene),
        "cargo_size": unit.cargo_size,
        "cargo_space": unit.cargo_space,
        "resource": unit.resource,
    }


def _origin(unit: UnitType, catalog: Catalog) -> dict[str, Any]:
    """Return what makes it, by which abilities, how long the first way takes, and all its requirements."""
    ways = [way for way in unit.made_by if _counts(way, unit, catalog)]
    first = catalog.ability_of_id.get(ways[0].ability) if ways else None
    return {
        "producers": list(dict.fromkeys(unit_name(way.producer) for way in ways)),
        "made_by": list(dict.fromkeys(way.ability for way in ways)),
        "build_s": seconds(ways[0].loops if ways else unit.build_loops),
        "requires": list(needs_of(first.requires).names) if first else [],
        "addon": needs_of(first.requires).addon if first else "",
    }


def _counts(way: ProductionRecord, unit: UnitType, catalog: Catalog) -> bool:
    """Return whether an order can make the type in this way: no cocoon, and not back from one of its own modes."""
    made = catalog.row_of_name.get(way.producer)
    if made is None or way.producer not in unit_names():
        return False
    if all(ability.id != way.ability for ability in catalog.abilities_of(made)):
        return False
    producer = catalog.units[made]
    return unit.id not in (producer.unit_alias, *producer.tech_alias) or producer.structure != unit.structure


def _ground(unit: UnitType, catalog: Catalog) -> dict[str, Any]:
    print_ = catalog.footprints.get(unit.footprint)
    return {
        "footprint": list(print_.size) if print_ and print_.cells else [],
        "power_radius": max((radius for radius, _ in unit.power), default=0),
        "needs_power": unit.needs_power,
        "needs_creep": unit.needs_creep,
        "makes_creep": unit.makes_creep,
    }


def _weapons(unit: UnitType, catalog: Catalog) -> Iterator[dict[str, Any]]:
    """Yield the weapons that a type fights with, as the API lists them; if it lists none, the hidden ones.

    Weapons that have to be switched on are left out: before that, the type is unarmed.
    """
    usable = [weapon for weapon in unit.weapons if weapon.works and not weapon.disabled]
    shown = [weapon for weapon in usable if not weapon.hidden]
    for weapon in shown:
        yield _shown(weapon) | {"min_range": 0 if _is_filled(weapon, usable) else plain(weapon.min_range)}
    for weapon in () if shown else usable:
        yield from _hidden(unit, weapon, catalog)


def _is_filled(weapon: Weapon, usable: list[Weapon]) -> bool:
    """Return whether a hidden weapon hits what is too near for this one: a Queen's talons, a Roach's claws."""
    near = [other for other in usable if other.hidden and other.targets == weapon.targets and not other.min_range]
    return any(other.range >= weapon.min_range - _MELEE_RANGE for other in near)


def _shown(weapon: Weapon) -> dict[str, Any]:
    bonus = {name: plain(more) for name, more in weapon.shown_bonus}
    blow = {"damage": plain(weapon.shown_damage), "attacks": weapon.shown_attacks, "bonus": bonus}
    return {"targets": weapon.targets, **_frame(weapon), **blow}


def _hidden(unit: UnitType, weapon: Weapon, catalog: Catalog) -> Iterator[dict[str, Any]]:
    """Yield a weapon that the API does not list: what is launched, a burst, or one hit for each plane.

    What a Brood Lord drops counts as the Brood Lord's, and a Locust's leap ends its flight: neither is listed again.
    """
    if weapon.launches:
        yield from _launched_weapons(unit, weapon, catalog)
    elif weapon.is_kamikaze:
        yield from _burst(weapon)
    elif [hit.when for hit in weapon.hits] == ["GroundUnitFilter", "else"]:
        for plane, hit in zip(("ground", "air"), weapon.hits, strict=True):
            yield {"targets": plane, **_frame(weapon), **_blow(hit)}
    else:
        yield _shown(weapon)


def _frame(weapon: Weapon) -> dict[str, Any]:
    rings = [ring.radius for hit in weapon.hits for ring in hit.area]
    return {
        "range": plain(weapon.range),
        "min_range": plain(weapon.min_range),
        "period_s": seconds(weapon.period_loops),
        "splash": plain(max(rings, default=0.0)),
        "returns": any(hit.returns for hit in weapon.hits),
    }


def _blow(hit: Hit) -> dict[str, Any]:
    return {"damage": plain(hit.damage), "attacks": 1, "bonus": {name: plain(more) for name, more in hit.bonus}}


def _launched_weapons(unit: UnitType, weapon: Weapon, catalog: Catalog) -> Iterator[dict[str, Any]]:
    """Yield the joint weapon of all that a unit can hold and launch, at the distance from which it launches them."""
    for hangar in catalog.abilities_of(unit.row):
        if hangar.effect == "arm" and hangar.unit == weapon.launches:
            for other in _weapons(catalog.unit(weapon.launches), catalog):
                count = other["attacks"] * int(hangar.numbers["max"])
                yield {**other, "range": plain(weapon.range), "attacks": count}


def _burst(weapon: Weapon) -> Iterator[dict[str, Any]]:
    """Yield a burst around the unit: its damage to units, and as a bonus the extra damage to structures."""
    hits = [hit for hit in weapon.hits if hit.damage and not hit.when]
    razes = sum(hit.damage for hit in hits if hit.area_affects.only == "structure")
    for hit in hits:
        if hit.area_affects.only != "structure":
            blow = _blow(hit)
            more = {"structure": plain(razes - hit.damage)} if razes > hit.damage else {}
            yield {"targets": weapon.targets, **_frame(weapon), **blow, "bonus": {**blow["bonus"], **more}}
