"""The page of the rules of combat: every unit, ability and upgrade of a melee game, and how far it is modelled.

Made from the tables and from the simulator's rules. What it calls implemented is used once by
`tests/simulator/engine/test_every_ability.py`, which reads the same lists.
"""

from __future__ import annotations

import inspect
from collections import Counter
from typing import TYPE_CHECKING

from docs.pages.markdown import code, codes, head, join, table
from khala_simulator.abilities.casting import ORDINARY, is_modelled
from khala_simulator.abilities.registry import DEATHS, PASSIVES, SKILLS
from khala_simulator.tables import stats
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.versions import VERSION_OF_BUILD

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.tables.catalog import Ability, Catalog, UnitType, Upgrade

RACES = ("protoss", "terran", "zerg")
IMPLEMENTED, ESTIMATED, MISSING = "implemented", "estimated", "not modelled"
USERS_SHOWN = 4


def page() -> str:
    """Return the three tables, by race, after a count of each state."""
    catalog = load_catalog()
    abilities = melee_abilities(catalog)
    return join(
        head(
            "Rules of combat",
            "`data/tables`, `abilities` and `systems` of `simulator/khala_simulator`",
        ),
        "What of StarCraft II the simulator models. *Implemented*: the numbers are the game's and the rule is known. "
        "*Estimated*: it works, and what is said beside it could not be taken from a source. *Not modelled*: it is "
        "answered with `NotSupported`, or has no effect. Every ability that is not *not modelled* is used once, with "
        "its effect seen, by `tests/simulator/engine/test_every_ability.py`. The tables are of version "
        f"{catalog.version}; {_others()} can be loaded instead.",
        table(
            ("", IMPLEMENTED, ESTIMATED, MISSING),
            [
                ("unit types", *_counts(unit_state(u)[0] for u in melee_units(catalog))),
                ("abilities", *_counts(ability_state(a)[0] for a in abilities)),
                ("upgrades", *_counts(upgrade_state(u)[0] for u in catalog.upgrades if u.researchable)),
            ],
        ),
        *(block for race in RACES for block in _race(catalog, race, abilities)),
        "## Upgrades",
        table(
            ("upgrade", "changes", "state", "what is missing"),
            [(code(u.name), len(u.changes), *upgrade_state(u)) for u in catalog.upgrades if u.researchable],
        ),
    )


def _others() -> str:
    return codes(version for version in VERSION_OF_BUILD.values() if version != load_catalog().version)


def _counts(states: Iterable[str]) -> tuple[int, int, int]:
    counted = Counter(states)
    return counted[IMPLEMENTED], counted[ESTIMATED], counted[MISSING]


def _race(catalog: Catalog, race: str, abilities: list[Ability]) -> list[str]:
    units = [unit for unit in melee_units(catalog) if unit.race == race]
    names = {unit.name for unit in units}
    own = [ability for ability in abilities if names & set(ability.users)]
    return [
        f"## {race.capitalize()}: units",
        table(("unit", "weapons", "by nature", "state", "estimates"), [_unit_row(unit) for unit in units]),
        f"## {race.capitalize()}: abilities",
        table(("ability", "id", "used by", "rule", "state", "estimates"), [_ability_row(a, names) for a in own]),
    ]


# units ----------------------------------------------------------------------------------------------------------------


def melee_units(catalog: Catalog) -> list[UnitType]:
    """Return the unit types of the three races that a melee game can have, by name."""
    return sorted((u for u in catalog.units if u.race in RACES and not u.not_in_melee), key=lambda u: u.name)


def unit_state(unit: UnitType) -> tuple[str, str]:
    """Return how far a unit type is modelled, and what of it is an estimate."""
    estimates = [f"{weapon.id}: {field}" for weapon in unit.weapons for field in weapon.estimates]
    return (ESTIMATED if estimates else IMPLEMENTED), "; ".join(estimates)


def _unit_row(unit: UnitType) -> tuple[object, ...]:
    weapons = codes(weapon.id for weapon in unit.weapons if not weapon.hidden)
    nature = [text for text, rules in (("acts", PASSIVES), ("when it dies", DEATHS)) if unit.name in rules]
    return code(unit.name), weapons, ", ".join(nature), *unit_state(unit)


# abilities ------------------------------------------------------------------------------------------------------------


def melee_abilities(catalog: Catalog) -> list[Ability]:
    """Return the abilities, other than moving and fighting, on the cards of types that a melee game can have, by id."""
    found = {a.id: a for unit in melee_units(catalog) for a in catalog.abilities_of(unit.row)}
    return [a for _, a in sorted(found.items()) if a.effect not in ORDINARY]


def ability_state(ability: Ability) -> tuple[str, str]:
    """Return how far an ability is modelled, and what of it is an estimate."""
    if not is_modelled(ability):
        return MISSING, ""
    estimates = SKILLS[ability.effect].estimates
    return (ESTIMATED if estimates else IMPLEMENTED), " ".join(estimates)


def _ability_row(ability: Ability, names: set[str]) -> tuple[object, ...]:
    users = [user for user in ability.users if user in names]
    more = f" and {len(users) - USERS_SHOWN} more" if len(users) > USERS_SHOWN else ""
    return (
        ability.name,
        code(ability.id),
        codes(users[:USERS_SHOWN]) + more,
        _rule(ability),
        *ability_state(ability),
    )


def _rule(ability: Ability) -> str:
    """Return the first sentence of the rule's own docstring."""
    skill = SKILLS.get(ability.effect)
    text = inspect.getdoc(skill.give or skill.effect) if skill is not None else ""
    return (text or "").split("\n\n", maxsplit=1)[0]


# upgrades -------------------------------------------------------------------------------------------------------------


def upgrade_state(upgrade: Upgrade) -> tuple[str, str]:
    """Return whether all changes of an upgrade have an effect, and which fields have none."""
    dead = sorted({f"{c.catalog} {c.field}" for c in upgrade.changes if not stats.reads(c)})
    named = {a.requires for a in load_catalog().abilities if a.requires is not None}
    unlocks = any(need.kind == "upgrade" and need.name == upgrade.name for need in named)
    if dead and len(dead) == len({f"{c.catalog} {c.field}" for c in upgrade.changes}) and not unlocks:
        return MISSING, ", ".join(dead)
    return IMPLEMENTED, ", ".join(dead)
