"""What the target of an action must be and must not be: the game's target filters, in words.

The words of the filters are those of `khala_bridge.knowledge` (`AbilityFacts.must`, `must_not`). The game alone judges
those that do not apply to units in sight (`missile`, `item`, …) or that the API does not show (`stasis`).
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from khala_bridge.catalogue.functions import functions
from khala_bridge.knowledge import abilities, knowledge
from khala_bridge.state import Alliance

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.catalogue.action import Action
    from khala_bridge.knowledge import AbilityFacts, UnitFacts
    from khala_bridge.state import Unit

_STATES: dict[str, Callable[[Unit], bool]] = {
    "player": lambda unit: unit.alliance == Alliance.OWN,
    "ally": lambda unit: unit.alliance == Alliance.ALLY,
    "enemy": lambda unit: unit.alliance == Alliance.ENEMY,
    "neutral": lambda unit: unit.alliance == Alliance.NEUTRAL,
    "ground": lambda unit: not unit.is_flying,
    "air": lambda unit: unit.is_flying,
    "buried": lambda unit: unit.is_burrowed,
    "underconstruction": lambda unit: unit.build_progress < 1.0,
    "canhaveenergy": lambda unit: unit.energy_max > 0,
    "hasenergy": lambda unit: unit.energy > 0,
}
"""What the API shows of a unit."""
_ATTRIBUTES = frozenset({"biological", "mechanical", "massive", "heroic"})
_NEEDED = {
    "ground": "a unit on the ground",
    "air": "a unit in the air",
    "structure": "a structure",
    "biological": "a biological unit",
    "mechanical": "a mechanical unit",
    "canhaveenergy": "a unit with energy",
    "hasenergy": "a unit with energy",
}
_BARRED = {
    "player": "a unit that is not yours",
    "ally": "a unit that is not an ally's",
    "enemy": "a unit that is no enemy",
    "neutral": "a unit that is somebody's",
    "structure": "a unit that is no structure",
    "massive": "a unit that is not massive",
    "heroic": "a unit that is not heroic",
    "buried": "a unit that is not burrowed",
    "underconstruction": "a unit that is finished",
}


def unfit(action: Action, unit: Unit) -> str | None:
    """Return what the target of an action must be and this unit is not: `an enemy unit`; None if the unit fits."""
    enemy = unit.alliance == Alliance.ENEMY
    if action.target == "enemy" and not enemy:
        return "an enemy unit"
    if action.target == "own" and (enemy or unit.alliance == Alliance.NEUTRAL):
        return "an own unit"
    facts = _facts(action.function)
    if facts is None:
        return None
    known = knowledge().get(unit.name)
    for word in facts.must:
        if word in _NEEDED and _is(word, unit, known) is False:
            return _NEEDED[word]
    for word in facts.must_not:
        if word in _BARRED and _is(word, unit, known):
            return _BARRED[word]
    return None


def needs_sight(action: Action) -> bool:
    """Return True if the place that an action is aimed at must be in sight."""
    facts = _facts(action.function)
    return facts is not None and facts.target != "unit" and "visible" in facts.must


def _is(word: str, unit: Unit, known: UnitFacts | None) -> bool | None:
    """Return whether a word of the filters applies to a unit; None if its type is unknown."""
    if word in _STATES:
        return _STATES[word](unit)
    if known is None:
        return None
    return known.structure if word == "structure" else word in (_ATTRIBUTES & {a.casefold() for a in known.attributes})


@functools.cache
def _facts(function: str | None) -> AbilityFacts | None:
    return None if function is None else abilities().get(functions()[function].ability_id)
