"""The cost of an ability, and the meant case of a general ability."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Collection

    from khala_bridge.knowledge import AbilityFacts, MapFacts


class Cost(NamedTuple):
    """The cost of one use."""

    minerals: float
    vespene: float
    supply: float


class Shortfall(NamedTuple):
    """An account that does not suffice."""

    account: str
    """`minerals`, `vespene` or `supply`."""
    needs: float
    has: float
    """The amount that is left; less than 0 for supply above the cap."""
    aside: float = 0.0
    """The amount set aside for structures that workers are on their way to build; not part of what is left."""


def price_of(facts: AbilityFacts) -> Cost:
    """Return the price of an ability; its supply is net: for a morph, only the difference counts."""
    return Cost(facts.minerals, facts.vespene, facts.supply)


@functools.cache
def cases(facts: MapFacts, ability: int, unit_type: str) -> tuple[AbilityFacts, ...]:
    """Return the cases of an ability for a type of unit: one, the levels of a research in order, or none."""
    found = facts.ability_of(ability, unit_type)
    if found is None:
        return ()
    special = [facts.abilities[number] for number in sorted(facts.abilities[ability].special)]
    return tuple(level for level in special if level.researches and unit_type in level.users) or (found,)


@functools.cache
def is_free(facts: MapFacts, ability: int, unit_type: str) -> bool:
    """Return True if the use of an ability takes nothing: no minerals, vespene, supply or energy, and no research."""
    return not any(any(price_of(case)) or case.energy or case.researches for case in cases(facts, ability, unit_type))


@functools.cache
def is_instant(facts: MapFacts, ability: int, unit_type: str) -> bool:
    """Return True if an ability happens at once, and the orders of its user stay as they are."""
    found = cases(facts, ability, unit_type)
    return bool(found) and all(case.instant for case in found)


def facts_for(facts: MapFacts, ability: int, unit_type: str, upgrades: Collection[str]) -> AbilityFacts | None:
    """Return the facts of an ability for a type of unit; of several levels of research, the next one."""
    found = cases(facts, ability, unit_type)
    if len(found) <= 1:
        return found[0] if found else None
    return next((case for case in found if case.researches not in upgrades), found[-1])
