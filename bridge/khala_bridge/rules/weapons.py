"""Which units can shoot: units without a weapon go where others attack, and some shoot without one of their own."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from khala_bridge.catalogue.functions import Function
    from khala_bridge.knowledge import MapFacts

ATTACK: Final = 3674
"""The general ability to attack."""
SCAN_MOVE: Final = 19
"""The ability of units without a weapon on an order to attack: they walk there."""


def is_attack(function: Function) -> bool:
    """Return True if a function attacks; scanning has the same general ability, and is for units without a weapon."""
    return ATTACK in (function.ability_id, function.general_id) and function.stem != "Scan_Move"


def can_shoot(facts: MapFacts, unit_type: str, able: frozenset[int]) -> bool:
    """Return True if a unit that can attack, by the game's answer, has a weapon now.

    A unit without one scans on the same order. Bunkers, and Oracles with their beam, shoot though their type has no
    weapon.
    """
    return facts.is_armed(unit_type) or not able.isdisjoint(_shots(facts))


@functools.cache
def _shots(facts: MapFacts) -> frozenset[int]:
    return frozenset(facts.abilities[ATTACK].special) - {SCAN_MOVE}
