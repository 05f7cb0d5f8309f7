"""What an action can be aimed at: the game's target filters in words, and which weapons reach which unit.

The words of the filters are those of `khala_bridge.knowledge` (`AbilityFacts.must`, `must_not`). The game alone judges
those that do not apply to units in sight (`missile`, `item`, …) or that the API does not show (`stasis`). Both offers
and refusals ask here.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.catalogue.functions import functions
from khala_bridge.names import unit_name
from khala_bridge.state import Alliance

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.catalogue.action import Action
    from khala_bridge.knowledge import AbilityFacts, MapFacts, UnitFacts
    from khala_bridge.state import Unit


class Aim(NamedTuple):
    """A unit as far as it matters to those that aim at it: units of the same values are equally good targets."""

    unit_type: int
    alliance: Alliance
    flying: bool
    planes: frozenset[str]
    """Where weapons hit it, `Unit.planes`; everywhere if its type is unknown."""
    burrowed: bool
    unfinished: bool
    has_energy: bool
    can_have_energy: bool
    hurt: bool
    """Whether it lacks health; always False for an enemy, at which nothing aims that mends."""

    @property
    def type(self) -> str:
        """The name of its type."""
        return unit_name(self.unit_type)


_EVERYWHERE = frozenset({"ground", "air"})


def aim_of(unit: Unit) -> Aim:
    """Return a unit as a target."""
    return Aim(
        unit.unit_type,
        unit.alliance,
        unit.is_flying,
        _EVERYWHERE if unit.facts is None else unit.planes,
        unit.is_burrowed,
        unit.build_progress < 1.0,
        unit.energy > 0,
        unit.energy_max > 0,
        unit.alliance != Alliance.ENEMY and unit.health < unit.health_max,
    )


_STATES: dict[str, Callable[[Aim], bool]] = {
    "player": lambda aim: aim.alliance == Alliance.OWN,
    "ally": lambda aim: aim.alliance == Alliance.ALLY,
    "enemy": lambda aim: aim.alliance == Alliance.ENEMY,
    "neutral": lambda aim: aim.alliance == Alliance.NEUTRAL,
    "ground": lambda aim: not aim.flying,
    "air": lambda aim: aim.flying,
    "buried": lambda aim: aim.burrowed,
    "underconstruction": lambda aim: aim.unfinished,
    "canhaveenergy": lambda aim: aim.can_have_energy,
    "hasenergy": lambda aim: aim.has_energy,
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
_HURT = "a unit that is hurt", lambda aim, _: aim.hurt
_WANTS: dict[str, tuple[str, Callable[[Aim, UnitFacts], bool]]] = {
    **dict.fromkeys(("repair", "mule_repair", "medivac_heal", "transfusion"), _HURT),
    "load": ("a unit that can be carried", lambda aim, known: known.cargo_size > 0 and not aim.burrowed),
    "spawn_larva": ("a Hatchery, Lair or Hive", lambda _, known: known.name in {"Hatchery", "Lair", "Hive"}),
    "supply_drop": ("a Supply Depot", lambda _, known: known.name in {"SupplyDepot", "SupplyDepotLowered"}),
}
"""By kind of ability: what the game wants of a target that no filter says."""


def unfit(facts: MapFacts, action: Action, aim: Aim) -> str | None:
    """Return what the target of an action must be and this one is not: `an enemy unit`; None if it fits."""
    return _unfit(facts, action.target, action.function, aim)


@functools.lru_cache(8192)
def _unfit(of_map: MapFacts, target: str | None, function: str | None, aim: Aim) -> str | None:
    enemy = aim.alliance == Alliance.ENEMY
    if target == "enemy" and not enemy:
        return "an enemy unit"
    if target == "own" and (enemy or aim.alliance == Alliance.NEUTRAL):
        return "an own unit"
    facts = _facts(of_map, function)
    if facts is None:
        return None
    known = of_map.units.get(aim.type)
    for word in facts.must:
        if word in _NEEDED and _is(word, aim, known) is False:
            return _NEEDED[word]
    for word in facts.must_not:
        if word in _BARRED and _is(word, aim, known):
            return _BARRED[word]
    return _lacking(of_map, facts, aim, known)


def reaches(facts: MapFacts, unit_type: str, aim: Aim) -> bool:
    """Return True if units of a type have a weapon against a target, or if its weapons are unknown."""
    mine = facts.units.get(unit_type)
    return mine is None or not mine.weapons or mine.hits(aim.planes)


def needs_sight(facts: MapFacts, action: Action) -> bool:
    """Return True if the place that an action is aimed at must be in sight."""
    found = _facts(facts, action.function)
    return found is not None and found.target != "unit" and "visible" in found.must


def _is(word: str, aim: Aim, known: UnitFacts | None) -> bool | None:
    """Return whether a word of the filters applies to a target; None if its type is unknown."""
    if word in _STATES:
        return _STATES[word](aim)
    if known is None:
        return None
    return known.structure if word == "structure" else word in (_ATTRIBUTES & {a.casefold() for a in known.attributes})


def _lacking(of_map: MapFacts, facts: AbilityFacts, aim: Aim, known: UnitFacts | None) -> str | None:
    """Return what the game wants of a target beyond the filters of an ability, or of the cases of a general one."""
    for does in (facts.does, *(of_map.abilities[case].does for case in facts.special)):
        if does in _WANTS:
            needed, fits = _WANTS[does]
            return None if known is None or fits(aim, known) else needed
    return None


@functools.cache
def _facts(of_map: MapFacts, function: str | None) -> AbilityFacts | None:
    return None if function is None else of_map.abilities.get(functions()[function].ability_id)
