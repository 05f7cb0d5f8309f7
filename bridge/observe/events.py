"""What happened between two observations: to the units of a team's screen, and to the whole side.

Compares two views of the same team; a view does not say who died, so the game's list of the dead is asked. An
enemy that is neither in sight nor among the dead has walked out of sight, which is another event.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Literal, TypeAlias

from protocol.messages import Event

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from protocol.messages import Alliance, TeamView, UnitView

EventKind: TypeAlias = Literal["hurt", "healed", "died", "joined", "appeared", "disappeared", "finished", "researched"]

MIN_CHANGE = 1.0
"""Health and shield that make an event; Protoss shields regain less than that between two quick observations."""


class Events:
    """The events of one moment; one that several teams witness is made once."""

    def __init__(self, before: Mapping[str, float], now: Mapping[str, float], dead: frozenset[str]) -> None:
        """Takes health and shield of all units by tag, at the observation before and now, and who died since."""
        self.dead = dead
        changes = {tag: total - before[tag] for tag, total in now.items() if tag in before}
        self.changes = {tag: change for tag, change in changes.items() if abs(change) >= MIN_CHANGE}
        """Health and shield gained or lost, by tag, as far as they make an event."""
        self._made: dict[tuple[EventKind, str, Alliance], Event] = {}

    def of_team(self, before: TeamView | None, now: TeamView) -> tuple[Event, ...]:
        """Events of a team in the order of its units; () for a team that is seen for the first time.

        Args:
            before: the team's view at the observation before, None if it had none.
            now: its view now; its own events are not looked at.
        """
        if before is None:
            return ()
        old = {unit.tag: unit for unit in _all(before)}
        return tuple(chain(self._arrivals_and_changes(old, now), self._losses(old, now)))

    def _arrivals_and_changes(self, old: dict[str, UnitView], now: TeamView) -> Iterator[Event]:
        changes = self.changes
        for unit in now.units:
            if unit.tag not in old or old[unit.tag].alliance != "own":
                yield self.event("joined", unit)
            elif unit.tag in changes:
                yield self._change(unit)
        for unit in chain(now.allies, now.enemies):
            if unit.tag not in old:
                yield self.event("appeared", unit)
            elif unit.tag in changes:
                yield self._change(unit)

    def _losses(self, old: dict[str, UnitView], now: TeamView) -> Iterator[Event]:
        still = {unit.tag for unit in _all(now)}
        for tag, unit in old.items():
            if tag not in still:
                yield self.event("died" if tag in self.dead else "disappeared", unit)

    def _change(self, unit: UnitView) -> Event:
        change = self.changes[unit.tag]
        return self.event("hurt" if change < 0 else "healed", unit, round(abs(change), 1))

    def event(self, what: EventKind, unit: UnitView, amount: float | None = None) -> Event:
        """What happened to a unit."""
        key = what, unit.tag, unit.alliance
        found = self._made.get(key)
        if found is None:
            found = Event(what=what, tag=unit.tag, type=unit.type, alliance=unit.alliance, amount=amount)
            self._made[key] = found
        return found


def _all(view: TeamView) -> Iterable[UnitView]:
    return chain(view.units, view.allies, view.enemies)
