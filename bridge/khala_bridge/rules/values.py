"""The input of a judgement: a side and its units at one moment, as plain values.

`khala_bridge.state.means` makes them from a snapshot.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.knowledge import MapFacts

FINISHED = 1.0
"""Build progress of a finished unit."""


class UnitState(NamedTuple):
    """The values of an own unit that matter here."""

    tag: int
    type: str
    able: frozenset[int] | None
    """Abilities that the game would take from it, each as itself and in its general form; None if it was not asked."""
    progress: float = FINISHED
    energy: float = 0.0
    addon: str = ""
    """Type of the finished add-on."""
    attached: bool = False
    """Whether it has an add-on, finished or not."""
    powered: bool = True
    """Whether it has the power that it needs."""
    orders: int = 0
    gathers: bool = True
    """Whether it has no orders except to gather."""
    disarmed: bool = False
    """Whether its weapon is off: it holds up a unit with its beam, or a spell disarms it."""

    @property
    def is_finished(self) -> bool:
        """True if its construction is finished."""
        return self.progress >= FINISHED


def distinct(units: Iterable[UnitState]) -> list[UnitState]:
    """Return the units without duplicates that differ only in the tag: at the start of a turn, one stands for all."""
    found: dict[tuple[object, ...], UnitState] = {}
    for unit in units:
        found.setdefault(unit[1:], unit)
    return list(found.values())


@dataclass(frozen=True)
class SideState:
    """The units and upgrades of a player; the accounts are in `Ledger`."""

    facts: MapFacts
    """Those of the data that the map depends on; everything that is judged of the side is judged by them."""
    units: dict[int, UnitState]
    """Own units by their tags, in ascending order."""
    upgrades: frozenset[str]
    ordered: frozenset[int]
    """Abilities that own units are ordered to use."""

    @functools.cached_property
    def by_type(self) -> dict[str, list[UnitState]]:
        """Own units by their types, finished or not."""
        found: dict[str, list[UnitState]] = {}
        for unit in self.units.values():
            found.setdefault(unit.type, []).append(unit)
        return found

    @functools.cached_property
    def standing(self) -> frozenset[str]:
        """Types of the finished units and structures."""
        return frozenset(unit.type for unit in self.units.values() if unit.is_finished)

    @functools.cached_property
    def able(self) -> frozenset[int] | None:
        """Abilities that any unit could use now; None if the game was not asked."""
        known = [unit.able for unit in self.units.values() if unit.able is not None]
        return frozenset().union(*set(known)) if known or not self.units else None

    def of_types(self, types: Iterable[str]) -> list[UnitState]:
        """Return the units of some types."""
        return [unit for name in types for unit in self.by_type.get(name, ())]

    def has(self, requirement: str) -> bool:
        """Return True if there is a structure or an upgrade, or what may stand in for it."""
        if requirement in self.facts.units:
            return not self.standing.isdisjoint(self.facts.stand_ins(requirement))
        return requirement in self.upgrades

    def builds(self, structure: str) -> bool:
        """Return True if a structure, or what may stand in for it, is finished or under construction."""
        return not self.by_type.keys().isdisjoint(self.facts.stand_ins(structure))
