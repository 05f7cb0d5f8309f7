"""Facts of abilities, from the simulator's tables.

One record per number of the API. A general ability (`Effect_Stim`) lists the special ones that it stands for, the
users of all of them, and the facts in which they agree.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from khala_bridge.catalogue.functions import functions_of
from khala_sc2.knowledge.measures import in_seconds, plain, seconds, sparse
from khala_sc2.knowledge.melee import melee_types
from khala_sc2.knowledge.naming import ability_name, table_name, unit_name, unit_names, upgrade_name, upgrade_names
from khala_simulator.tables.abilities import AIMS

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability, Filter, Need
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.tables.records import Upgrade

TARGETS: Final = {aim: name for name, aim in AIMS.items()}
EVERYWHERE: Final = 500
"""Range that means the whole map in the tables."""
OWN_FIGURES: Final = frozenset({"range", "time", "unit", "units", "energy", "supply", "buff", "count"})
"""Figures of a skill that the record already has, or that are words of the tables."""
SHARED: Final = (
    *(
        "range",
        "everywhere",
        "must",
        "must_not",
        "autocast",
        "instant",
        "energy",
        "life",
        "minerals",
        "vespene",
        "supply",
    ),
    *("cooldown_s", "charges", "requires", "addon", "produces", "count", "researches", "time_s", "figures"),
)
"""Facts of a general ability if all its special ones agree."""


class Needs(NamedTuple):
    """What an ability requires of a player and of the unit that uses it."""

    names: tuple[str, ...] = ()
    """Structures and upgrades; all are needed."""
    addon: str = ""
    """What has to be attached to the unit itself."""


def ability_facts(catalog: Catalog) -> dict[str, dict[str, Any]]:
    """Return one record for each ability that a melee game's unit or a PySC2 function uses, by its number."""
    users = _users(catalog)
    special = {a.id: _special(a, users.get(a.id, []), catalog) for a in catalog.abilities if a.effect != "general"}
    special = {number: record for number, record in special.items() if record["melee"] or functions_of(number)}
    general = {
        a.id: _general(a, {s.id: special[s.id] for s in catalog.abilities if s.general == a.id and s.id in special})
        for a in catalog.abilities
        if a.effect == "general"
    }
    return {str(number): sparse(record) for number, record in sorted({**special, **general}.items())}


def needs_of(need: Need | None) -> Needs:
    """Return the structures and upgrades in a condition; of alternatives the first, which represents the others.

    Conditions on the state of the unit itself and on its orders are left out: the game reports these.
    """
    leaves = list(_leaves(need))
    here = [name for name, state in leaves if state.endswith("_here")]
    names = dict.fromkeys(_name(name) for name, state in leaves if state == "done")
    return Needs(tuple(names), "TechLab" if any(name.endswith("TechLab") for name in here) else "")


def research_of(upgrade: Upgrade, catalog: Catalog) -> Ability | None:
    """Return the ability that researches an upgrade; of several, the one of a structure in the current game.

    When an upgrade has moved to another structure, the tables keep both, and say only of some where it is.
    """
    found = [a for a in catalog.abilities if a.effect == "research" and a.upgrade == upgrade.name]
    here = [a for a in found if set(a.users) & set(upgrade.at)]
    fits = [a for a in found if (a.minerals, a.vespene) == upgrade.cost]
    return next(iter(here or fits or found), None)


def _leaves(need: Need | None) -> list[tuple[str, str]]:
    if need is None or need.kind in ("not", "const", "op", "behavior"):
        return []
    if need.kind in ("unit", "upgrade"):
        return [(need.name.removeprefix("Alias_"), need.state)]
    parts = need.parts
    if need.kind == "cmp":
        wanted = parts[1].value if len(parts) > 1 else None
        return _leaves(parts[0]) if need.name in ("==", ">=", ">") and wanted else []
    return [leaf for part in (parts[:1] if need.kind == "or" else parts) for leaf in _leaves(part)]


def _name(name: str) -> str:
    return upgrade_names().get(name) or unit_names().get(name) or name


def _users(catalog: Catalog) -> dict[int, list[str]]:
    """Return the names of the types that can be ordered to use an ability, by its number."""
    found: dict[int, list[str]] = {}
    for unit in catalog.units:
        if not unit.like and unit.name in unit_names():
            for ability in catalog.abilities_of(unit.row):
                found.setdefault(ability.id, []).append(unit_name(unit.name))
    return {number: sorted(names) for number, names in found.items()}


def _special(ability: Ability, users: list[str], catalog: Catalog) -> dict[str, Any]:
    upgrade = catalog.upgrade_of.get(ability.upgrade) if ability.upgrade else None
    in_melee = ability.effect and any(table_name(name) in melee_types(catalog) for name in users)
    if ability.effect == "research":
        in_melee = in_melee and upgrade is not None and upgrade.researchable
        in_melee = in_melee and upgrade is not None and research_of(upgrade, catalog) == ability
    elif ability.unit in catalog.row_of_name and ability.unit not in melee_types(catalog):
        in_melee = False
    return {
        "name": ability_name(ability),
        "does": ability.effect,
        "general": ability.general,
        "melee": bool(in_melee),
        "users": users or sorted(unit_names()[name] for name in ability.users if name in unit_names()),
        "target": TARGETS[ability.aim],
        **_terms(ability),
        **_outcome(ability),
        "figures": _figures(ability),
    }


def _terms(ability: Ability) -> dict[str, Any]:
    """Return its costs and requirements."""
    needs = needs_of(ability.requires)
    comes_back = ability.charges.loops if ability.charges else 0.0
    return {
        "range": None if ability.range >= EVERYWHERE else plain(ability.range),
        "everywhere": ability.range >= EVERYWHERE,
        "energy": plain(ability.energy),
        "life": plain(ability.life),
        "minerals": plain(ability.minerals),
        "vespene": plain(ability.vespene),
        "supply": plain(ability.supply),
        "cooldown_s": seconds(ability.cooldown_loops or comes_back),
        "charges": ability.charges.max if ability.charges else 0,
        "requires": list(needs.names),
        "addon": needs.addon,
        "autocast": ability.autocast,
        "instant": ability.transient,
        **_filter(ability.filters),
    }


def _filter(filters: Filter) -> dict[str, Any]:
    return {"must": [w.lower() for w in filters.required], "must_not": [w.lower() for w in filters.excluded]}


def _outcome(ability: Ability) -> dict[str, Any]:
    """Return its results, and how long they take."""
    research = ability.effect == "research"
    count = max(ability.count, len(ability.units), ability.numbers.get("count", 1))
    return {
        "produces": unit_name(ability.unit) if ability.unit else "",
        "researches": upgrade_name(ability.upgrade) if ability.upgrade else "",
        "count": count if count > 1 else 0,
        "time_s": seconds(ability.loops) if ability.loops and (research or ability.unit) else 0,
    }


def _figures(ability: Ability) -> dict[str, Any]:
    """Return the skill's own numbers; the written words cover the tables' words and lists."""
    own = in_seconds(ability.numbers)
    return {
        key: value
        for key, value in own.items()
        if isinstance(value, int | float) and not isinstance(value, bool) and key not in OWN_FIGURES and value
    }


def _general(ability: Ability, special: dict[int, dict[str, Any]]) -> dict[str, Any]:
    """Return a record for a general ability, without facts in which the special ones differ."""
    live = [record for record in special.values() if record["melee"]] or list(special.values())
    shared = {key: live[0][key] for key in SHARED if live and all(record[key] == live[0][key] for record in live)}
    targets = {record["target"] for record in live}
    return {
        "name": ability_name(ability),
        "does": "general",
        "special": list(special),
        "melee": any(record["melee"] for record in special.values()),
        "users": sorted({user for record in live for user in record["users"]}),
        "target": targets.pop() if len(targets) == 1 else TARGETS[ability.aim],
        **shared,
    }
