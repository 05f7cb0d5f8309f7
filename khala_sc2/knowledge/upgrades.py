"""Facts of upgrades, from the simulator's tables: price, place, time, and what each changes on which type."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from khala_sc2.knowledge.abilities import needs_of, research_of
from khala_sc2.knowledge.measures import per_second, plain, seconds, sparse
from khala_sc2.knowledge.naming import unit_name, unit_names, upgrade_name, upgrade_names

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import Change, UnitType, Upgrade

UNIT_FIELDS: Final = {
    "Speed": ("speed", "speed_n"),
    "LifeMax": ("health", "life"),
    "LifeArmor": ("armor", "armor"),
    "ShieldArmor": ("shield_armor", "shield_armor"),
    "EnergyStart": ("energy_start", "energy_start"),
}
"""Fields of a type that upgrades change: our name, and the record's field with the value before the upgrade."""
WEAPON_FIELDS: Final = {"Range": "range", "RateMultiplier": "attack_speed"}
"""Fields of a weapon that upgrades change; the speed of attacks is a share of the original speed."""
BONUS: Final = "AttributeBonus["


def upgrade_facts(catalog: Catalog) -> dict[str, dict[str, Any]]:
    """Return one record for each upgrade that PySC2 has a name for or a player can research, by its name."""
    known = [u for u in catalog.upgrades if u.name in upgrade_names() or u.researchable]
    known.sort(key=lambda upgrade: upgrade_name(upgrade.name))
    return {upgrade_name(upgrade.name): sparse(_upgrade(upgrade, catalog)) for upgrade in known}


def _upgrade(upgrade: Upgrade, catalog: Catalog) -> dict[str, Any]:
    """Return one record; price, time and place are those of its research, if there is one."""
    research = research_of(upgrade, catalog)
    minerals, vespene = (research.minerals, research.vespene) if research else upgrade.cost
    changes = _changes(upgrade, catalog)
    enabled = [a for a in catalog.abilities if upgrade_name(upgrade.name) in needs_of(a.requires).names]
    users = {unit_name(u) for a in enabled if a.effect != "research" for u in a.users if u in unit_names()}
    places = [catalog.unit(place) for place in (research.users if research else upgrade.at)]
    return {
        "id": upgrade.id,
        "race": places[0].race if places else "",
        "melee": upgrade.researchable,
        "minerals": minerals,
        "vespene": vespene,
        "time_s": seconds(research.loops if research else upgrade.loops),
        "at": [unit_name(place.name) for place in places],
        "ability": research.id if research else upgrade.ability,
        "requires": list(needs_of(research.requires).names) if research else [],
        "affects": sorted(users | changes.keys()),
        "enables": [a.id for a in enabled if a.effect != "research"],
        "changes": changes,
    }


def _changes(upgrade: Upgrade, catalog: Catalog) -> dict[str, dict[str, float]]:
    """Return, by type and field, how much is added; without types that PySC2 has no name for."""
    known = [unit for unit in catalog.units if not unit.like and unit.name in unit_names()]
    found = {unit_name(unit.name): _on(unit, upgrade.changes) for unit in known}
    return {name: own for name, own in sorted(found.items()) if own}


def _on(unit: UnitType, changes: tuple[Change, ...]) -> dict[str, float]:
    """Return what an upgrade adds to one type, by our names of the fields."""
    own: dict[str, float] = {}
    hits: dict[tuple[str, str], float] = {}
    for change in changes:
        if not isinstance(change.value, int | float):
            continue
        value = -change.value if change.op == "subtract" else change.value
        if change.catalog == "effect":
            hits[change.entry, change.field] = hits.get((change.entry, change.field), 0) + value
        elif field := _field(unit, change):
            more = value - getattr(unit, UNIT_FIELDS[change.field][1]) if change.op == "set" else value
            own[field] = own.get(field, 0) + more
    if "speed" in own:
        own["speed"] = per_second(own["speed"])
    return sparse({field: plain(value) for field, value in {**own, **_damage(unit, hits)}.items()})


def _field(unit: UnitType, change: Change) -> str:
    if change.catalog == "unit" and change.entry == unit.name:
        return UNIT_FIELDS[change.field][0] if change.field in UNIT_FIELDS else ""
    if change.catalog == "weapon" and any(weapon.id == change.entry for weapon in unit.weapons):
        return WEAPON_FIELDS.get(change.field, "")
    return ""


def _damage(unit: UnitType, changes: dict[tuple[str, str], float]) -> dict[str, float]:
    """Return the bonus to the strongest hit: by plane, if the type has different weapons for the ground and the air.

    Hits of one's own units are left out, and weapons that clients cannot see, if there are others.
    """
    own: dict[str, float] = {}
    weapons = [weapon for weapon in unit.weapons if not (weapon.hidden or weapon.disabled)] or unit.weapons
    split = len({weapon.targets for weapon in weapons}) > 1
    for weapon in weapons:
        for hit in weapon.hits:
            for (effect, field), value in changes.items():
                if effect != hit.effect or hit.when.startswith("Friendly"):
                    continue
                against = f"_against_{field[len(BONUS) : -1].lower()}" if field.startswith(BONUS) else ""
                if hit.area_affects.only == "structure":
                    against = "_against_structure"
                name = f"{weapon.targets}_damage{against}" if split else f"damage{against}"
                own[name] = max(own.get(name, 0), value)
    return own
