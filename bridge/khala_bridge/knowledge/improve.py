"""Unit types as they are with a side's upgrades: the same records, with other numbers.

Pure functions of records. Above: `prompt`, which an agent with upgrades reads.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Final

from khala_bridge.knowledge.facts import VERSION
from khala_bridge.knowledge.load import describe_abilities, knowledge, upgrades

if TYPE_CHECKING:
    from khala_bridge.knowledge.model import UnitFacts, WeaponFacts

_PLAIN: Final = ("speed", "health", "armor")
"""Numbers of a body that upgrades add to."""
_FIGHTERS: Final = {"Carrier": "Interceptor"}
"""Types whose weapon is that of what they launch."""
_AGAINST: Final = "damage_against_"


@functools.lru_cache(4096)
def improve(name: str, researched: frozenset[str], version: str = VERSION) -> UnitFacts | None:
    """Return a type as it is with these upgrades; None if the type is unknown."""
    kind = knowledge(version).get(name)
    if kind is None or not researched:
        return kind
    body = _sum(name, researched, version)
    arms = _sum(_FIGHTERS.get(name, name), researched, version)
    return kind.model_copy(
        update={
            **{field: getattr(kind, field) + body.get(field, 0) for field in _PLAIN},
            "weapons": tuple(_sharper(weapon, arms) for weapon in kind.weapons),
            "abilities": describe_abilities(kind, researched, version=version),
        }
    )


def _sum(name: str, researched: frozenset[str], version: str) -> dict[str, float]:
    """Return what the upgrades add to a type together, by field."""
    total: dict[str, float] = {}
    better = upgrades(version)
    for known in (better[upgrade] for upgrade in researched if upgrade in better):
        for field, more in known.changes.get(name, {}).items():
            total[field] = total.get(field, 0) + more
    return total


def _sharper(weapon: WeaponFacts, more: dict[str, float]) -> WeaponFacts:
    own = {field.removeprefix(f"{weapon.targets}_"): value for field, value in more.items()}
    extra = {field.removeprefix(_AGAINST): value for field, value in own.items() if field.startswith(_AGAINST)}
    return weapon.model_copy(
        update={
            "range": weapon.range + own.get("range", 0),
            "period_s": weapon.period_s / (1 + own.get("attack_speed", 0)),
            "damage": weapon.damage + own.get("damage", 0),
            "bonus": {what: weapon.bonus.get(what, 0) + extra.get(what, 0) for what in (*weapon.bonus, *extra)},
        }
    )
