"""The game's tables: what a unit, a weapon and an upgrade are in one version of StarCraft II.

Reads ``data/tables/<version>`` into the records of ``records``, once per process and data set. A data set is what the
mods that a map depends on make of the game: the tables are those of the multiplayer, and ``data/tables/<set>.yaml`` has
the values that another set has instead (see ``data/tables/SOURCES.md``). Nothing here is about one particular game:
which upgrades a player has is applied in ``stats``, where the records become arrays.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources
from typing import Any, Final

from khala_simulator.tables.abilities import Ability, ability_from
from khala_simulator.tables.buffs import Buff, buff_from
from khala_simulator.tables.loader import read_data
from khala_simulator.tables.prices import add_price
from khala_simulator.tables.records import (
    Affects,
    Area,
    Change,
    Hit,
    ProductionRecord,
    Search,
    SweepRecord,
    UnitFootprint,
    UnitType,
    Upgrade,
    Weapon,
)
from khala_simulator.tables.versions import (
    BUILD_OF_VERSION,
    DATA_SETS,
    DEFAULT_DATA,
    DEFAULT_VERSION,
    VERSION_OF_BUILD,
    DataSet,
)

__all__ = [
    "LOOPS_PER_NORMAL_SECOND",
    "Ability",
    "Buff",
    "Catalog",
    "CatalogError",
    "Hit",
    "ProductionRecord",
    "UnitFootprint",
    "UnitType",
    "Upgrade",
    "Weapon",
    "load_catalog",
    "renumber",
]

LOOPS_PER_NORMAL_SECOND: Final = 16


class CatalogError(ValueError):
    """A table version, unit or weapon that is not in the data was requested."""


@dataclass(frozen=True, eq=False)
class Catalog:
    """All tables of one game version and data set, with look-up by id and by name.

    Rows and ids are the same in all data sets of a version. ``cards`` and ``ordinary`` are by unit row: the commands of
    a type, and the ability ids by which it moves, attacks, patrols, holds and stops.
    """

    version: str
    build: int
    data: DataSet
    units: tuple[UnitType, ...]
    weapons: tuple[Weapon, ...]
    upgrades: tuple[Upgrade, ...]
    footprints: dict[str, UnitFootprint]
    row_of_id: dict[int, int]
    row_of_name: dict[str, int]
    abilities: tuple[Ability, ...]
    buffs: tuple[Buff, ...]
    cards: tuple[tuple[Ability, ...], ...]
    ordinary: tuple[dict[str, int], ...]
    ability_of_id: dict[int, Ability]
    buff_of_name: dict[str, Buff]
    upgrade_of: dict[int | str, Upgrade]

    def unit(self, key: int | str) -> UnitType:
        """Return the unit type with this API id or this name; raise ``CatalogError`` when there is none."""
        row = self.row_of_id.get(key) if isinstance(key, int) else self.row_of_name.get(key)
        if row is None:
            raise CatalogError(f"no unit type {key!r} in the tables of version {self.version}")
        return self.units[row]

    def ability(self, number: int) -> Ability:
        """Return the specific ability with this API id; raise ``CatalogError`` when there is none."""
        found = self.ability_of_id.get(number)
        if found is None:
            raise CatalogError(f"no ability {number} in the tables of version {self.version}")
        return found

    def abilities_of(self, row: int) -> tuple[Ability, ...]:
        """Return the abilities of units of the type in this row, by ascending id."""
        return self.cards[row]

    def buff(self, name: str) -> Buff:
        """Return the buff with this name; raise ``CatalogError`` when there is none."""
        found = self.buff_of_name.get(name)
        if found is None:
            raise CatalogError(f"no buff {name!r} in the tables of version {self.version}")
        return found

    def upgrade(self, key: int | str) -> Upgrade:
        """Return the upgrade with this API id or this name; raise ``CatalogError`` when there is none."""
        found = self.upgrade_of.get(key)
        if found is not None:
            return found
        raise CatalogError(f"no upgrade {key!r} in the tables of version {self.version}")


def load_catalog(version: str | int = DEFAULT_VERSION, data: DataSet = DEFAULT_DATA) -> Catalog:
    """Return the tables of a game version, given as "4.10" or as its build number 75689, with the values of a data set.

    Raises:
        CatalogError: no tables for this version or data set are shipped.
    """
    name = VERSION_OF_BUILD.get(version) if isinstance(version, int) else version
    if name is None or name not in VERSION_OF_BUILD.values():
        known = ", ".join(f"{v} (build {b})" for b, v in VERSION_OF_BUILD.items())
        raise CatalogError(f"no tables for game version {version!r}; shipped are {known}")
    if data not in DATA_SETS:
        raise CatalogError(f"no data set {data!r}; shipped are {', '.join(DATA_SETS)}")
    return _catalog(name, data)


@cache
def _catalog(name: str, data: DataSet) -> Catalog:
    def rows(kind: str) -> list[dict[str, Any]]:
        return _with_differences(_rows(name, kind), kind, data)

    weapons = tuple(_weapon(row, raw) for row, raw in enumerate(rows("weapons")))
    weapon_of_id = {w.id: w for w in weapons}
    units = tuple(_unit(row, raw, weapon_of_id) for row, raw in enumerate(_alike(rows("units"))))
    upgrades = tuple(_upgrade(raw) for raw in rows("upgrades"))
    unit_of = {unit.name: unit for unit in units}
    upgrade_of = {upgrade.name: upgrade for upgrade in upgrades}
    abilities = tuple(add_price(ability_from(raw), unit_of, upgrade_of) for raw in rows("abilities"))
    cards = _cards(units, abilities)
    buffs = tuple(buff_from(row, raw) for row, raw in enumerate(rows("buffs")))
    return Catalog(
        version=name,
        build=BUILD_OF_VERSION[name],
        data=data,
        units=units,
        weapons=weapons,
        upgrades=upgrades,
        footprints={raw["id"]: _footprint(raw) for raw in rows("footprints")},
        row_of_id={u.id: u.row for u in units},
        row_of_name={u.name: u.row for u in units},
        abilities=abilities,
        buffs=buffs,
        cards=cards,
        ordinary=tuple({a.effect: a.id for a in card if a.effect in BASICS} for card in cards),
        ability_of_id={a.id: a for a in abilities},
        buff_of_name={b.name: b for b in buffs},
        upgrade_of={key: u for u in upgrades for key in (u.id, u.name)},
    )


@lru_cache(maxsize=8)
def renumber(catalog: Catalog, names: tuple[str, ...]) -> Catalog:
    """Return the tables with the ids of these types dealt out anew, the lowest first: a map numbers its own types."""
    if not names:
        return catalog
    ids = dict(zip(names, sorted(catalog.unit(name).id for name in names), strict=True))
    units = tuple(dataclasses.replace(unit, id=ids.get(unit.name, unit.id)) for unit in catalog.units)
    return dataclasses.replace(catalog, units=units, row_of_id={unit.id: unit.row for unit in units})


WALK_BY_UPGRADE: Final = frozenset({"RoachBurrowed"})
"""Types without a speed of their own that get one by upgrade."""
KEY: Final = {"units": "name", "upgrades": "name"}
"""The field by which a data set names the rows of a table; all others have an ``id``."""
BASICS: Final = ("stop", "move", "patrol", "hold_position", "scan_move", "attack")


def _cards(units: tuple[UnitType, ...], abilities: tuple[Ability, ...]) -> tuple[tuple[Ability, ...], ...]:
    """Return the command card of every type; it holds one ability per basic order, the one that fits the type."""
    of_name: dict[str, dict[int, Ability]] = {unit.name: {} for unit in units}
    smart = next(a for a in abilities if a.effect == "smart")
    for ability in abilities:
        for user in ability.users:
            if ability.effect not in ("", "general", "smart") and user in of_name:
                of_name[user][ability.id] = ability
    return tuple(_card(unit, of_name[unit.like or unit.name], smart) for unit in units)


def _card(unit: UnitType, found: dict[int, Ability], smart: Ability) -> tuple[Ability, ...]:
    armed = any(unit.weapon_against(plane) is not None for plane in ("ground", "air"))
    walks = unit.speed_n > 0.0 or unit.name in WALK_BY_UPGRADE
    fits = {"attack": armed, "scan_move": walks and not armed, "stop": armed or walks}
    card = {} if unit.uncommandable else dict(found)
    seen: set[str] = set()
    for number, ability in sorted(found.items()):
        if ability.effect not in BASICS:
            continue
        if ability.effect in seen or not fits.get(ability.effect, walks):
            card.pop(number, None)
        else:
            seen.add(ability.effect)
    if card or (not unit.uncommandable and (armed or walks)):
        card[smart.id] = smart
    return tuple(ability for _, ability in sorted(card.items()))


def _rows(version: str, kind: str) -> list[dict[str, Any]]:
    path = resources.files("khala_simulator.data") / "tables" / version / f"{kind}.json"
    rows: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["rows"]
    return rows


def _with_differences(rows: list[dict[str, Any]], kind: str, data: DataSet) -> list[dict[str, Any]]:
    """Return the rows of a kind of table with the values of a data set in place of the multiplayer's."""
    changes: dict[str | int, dict[str, Any]] = {} if data == DEFAULT_DATA else dict(_differences(data).get(kind, {}))
    return [_with(row, changes[key]) if (key := row.get(KEY.get(kind, "id"))) in changes else row for row in rows]


@cache
def _differences(data: DataSet) -> dict[str, Any]:
    found: dict[str, Any] = read_data("tables", f"{data}.yaml")
    return found


def _with(row: dict[str, Any], change: dict[str, Any]) -> dict[str, Any]:
    """Return a row with other values; ``hits`` by effect are values of the row's own hits of that effect."""
    hits = change.get("hits")
    if isinstance(hits, dict):
        change = {**change, "hits": [{**hit, **hits.get(hit["effect"], {})} for hit in row["hits"]]}
    return {**row, **change}


def _alike(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows, with missing values of a row that is ``like`` another filled in from that one."""
    of_name = {row["name"]: row for row in rows}
    return [{**of_name[row["like"]], "made_by": (), **row} if "like" in row else row for row in rows]


def _pairs(bonus: dict[str, float]) -> tuple[tuple[str, float], ...]:
    return tuple(sorted(bonus.items()))


def _own(record: type[Any], raw: dict[str, Any]) -> dict[str, Any]:
    """Return the values of a row that are fields of ``record``."""
    names = {f.name for f in dataclasses.fields(record)}
    return {k: v for k, v in raw.items() if k in names}


def _affects(raw: dict[str, Any]) -> Affects:
    return Affects(**_own(Affects, raw), excluding=raw.get("except", ""))


def _sweep(raw: dict[str, Any]) -> SweepRecord:
    points = tuple(map(tuple, raw["points"]))
    return SweepRecord(affects=_affects(raw), **{**_own(SweepRecord, raw), "points": points})


def _hit(raw: dict[str, Any]) -> Hit:
    raw = dict(raw)
    sweep, search = raw.pop("sweep", None), raw.pop("search", None)
    return Hit(
        bonus=_pairs(raw.pop("bonus", {})),
        missile_speed_n=raw.pop("missile_speed", None),
        missile_acceleration_n=raw.pop("missile_acceleration", None),
        missile_start_n=raw.pop("missile_start", 0.0),
        area=tuple(Area(**ring) for ring in raw.pop("area", ())),
        area_affects=_affects(raw.pop("area_affects", {})),
        sweep=sweep and _sweep(sweep),
        search=search and Search(affects=_affects(search), **_own(Search, search)),
        **raw,
    )


def _weapon(row: int, raw: dict[str, Any]) -> Weapon:
    raw = dict(raw)
    shown = raw.pop("shown")
    return Weapon(
        row=row,
        hits=tuple(_hit(h) for h in raw.pop("hits", ())),
        jitter_loops=tuple(raw.pop("jitter_loops", (0.0, 0.0))),
        backswing_loops=raw.pop("backswing_loops", 0.0),
        shown_damage=shown["damage"] or 0.0,
        shown_attacks=shown["attacks"],
        shown_bonus=_pairs(shown["bonus"]),
        estimates=tuple(raw.pop("estimates", ())),
        **raw,
    )


def _production(raw: dict[str, Any]) -> ProductionRecord:
    cost = tuple(raw.get("cost", (0, 0)))
    rest = {k: v for k, v in raw.items() if k not in ("from", "cost")}
    return ProductionRecord(producer=raw["from"], cost=cost, **{"ability": 0, **rest})


def _unit(row: int, raw: dict[str, Any], weapon_of_id: dict[str, Weapon]) -> UnitType:
    raw = dict(raw)
    resource = raw.pop("resource", {})
    for name in ("attributes", "planes", "collide", "cost", "tech_alias"):
        if name in raw:
            raw[name] = tuple(raw[name])
    return UnitType(
        row=row,
        made_by=tuple(_production(p) for p in raw.pop("made_by", ())),
        weapons=tuple(weapon_of_id[w] for w in raw.pop("weapons", ())),
        resource=resource.get("kind", ""),
        resource_amount=resource.get("amount", 0),
        per_trip=resource.get("per_trip", 0),
        harvest_loops=resource.get("harvest_n", 0.0) * LOOPS_PER_NORMAL_SECOND,
        ideal_harvesters=resource.get("ideal", 0),
        power=tuple((p["radius"], p.get("level", 0)) for p in raw.pop("power", ())),
        **raw,
    )


def _upgrade(raw: dict[str, Any]) -> Upgrade:
    raw = dict(raw)
    return Upgrade(
        cost=tuple(raw.pop("cost", (0, 0))),
        at=tuple(raw.pop("at", ())),
        changes=tuple(Change(*change) for change in raw.pop("changes", ())),
        **raw,
    )


def _footprint(raw: dict[str, Any]) -> UnitFootprint:
    x0, y0, x1, y1 = raw["area"]
    marked: dict[str, list[tuple[int, int]]] = {"x": [], "o": []}
    for line, text in enumerate(raw["rows"]):
        for column, mark in enumerate(text):
            if mark in marked:
                marked[mark].append((x0 + column, y1 - 1 - line))
    check = raw.get("check", {}).get("x", {})
    return UnitFootprint(
        id=raw["id"],
        area=(x0, y0, x1, y1),
        cells=tuple(marked["x"]),
        around=tuple(marked["o"]),
        forbids=frozenset(check.get("forbid", ())),
        requires=frozenset(check.get("require", ())),
    )
