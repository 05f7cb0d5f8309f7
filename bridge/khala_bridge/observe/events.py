"""Events between two observations: of the units on a team's screen, and of the whole side.

Compares two views of the same team, with the game's list of dead units, which no view has. An enemy that is neither in
sight nor among the dead has walked out of sight, which is another event. Units of the own side that come onto a team's
screen or leave it make none: nothing happened to them. `khala_bridge.observe.changes` is above.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

from khala_protocol.messages import Event

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Mapping

    from khala_protocol.messages import Alliance, TeamView, UnitView

EventKind: TypeAlias = Literal["hurt", "healed", "died", "joined", "appeared", "disappeared", "finished", "researched"]

MIN_CHANGE = 1.0
"""Change of health and shield that makes an event; Protoss shields regain less between two quick observations."""


_NOTHING = Event(what="appeared", tag="", type="", alliance="neutral", amount=None)


class Witnessed(NamedTuple):
    """Tags of the units in a team's view, in its order; views are many, and slower to go through."""

    own: tuple[str, ...] = ()
    allies: tuple[str, ...] = ()
    enemies: tuple[str, ...] = ()


class Events:
    """The events since one moment; an event that several teams witness is made once."""

    def __init__(self, before: Mapping[str, float], now: Mapping[str, UnitView], dead: frozenset[str]) -> None:
        """Take health and shield by tag at the observation before, every unit now, and the tags of the dead since."""
        self._dead = dead
        self._now = now
        totals = ((tag, unit.health + unit.shield - before[tag]) for tag, unit in now.items() if tag in before)
        changes = {tag: change for tag, change in totals if abs(change) >= MIN_CHANGE}
        self.changes = {tag: by for tag, by in changes.items() if by < 0 or now[tag].build_progress >= 1}
        """Health and shield gained or lost, by tag, as far as they make an event; what is being built only grows."""
        self._changed: dict[Alliance, dict[str, Event]] = {}

    def of_team(self, before: TeamView, saw: Witnessed, now: Witnessed) -> tuple[Event, ...]:
        """Return the events of a team in the order of its units.

        Args:
            before: the team's view at the observation before.
            saw: tags of the units in that view.
            now: tags of the units that it sees now.
        """
        old = {*saw.own, *saw.allies, *saw.enemies}
        found = self._happenings(now.own, frozenset(saw.own), "joined", "own")
        found += self._happenings(now.allies, old, None, "ally")
        found += self._happenings(now.enemies, old, "appeared", "enemy")
        if gone := old.difference(now.own, now.allies, now.enemies):
            units = (unit for unit in chain(before.units, before.allies, before.enemies) if unit.tag in gone)
            ends = [(self._end_of(unit), unit) for unit in units]
            news = ((end, unit) for end, unit in ends if end == "died" or unit.alliance != "ally")
            found += [_event(end, unit, unit.alliance) for end, unit in news]
        return tuple(found)

    def _end_of(self, unit: UnitView) -> EventKind:
        return "died" if unit.tag in self._dead else "disappeared"

    def _happenings(
        self, tags: Iterable[str], old: Container[str], arrival: EventKind | None, alliance: Alliance
    ) -> list[Event]:
        """Return the events of some units that came, were hurt or were healed; without an arrival, nobody comes."""
        changed = self._changed_as(alliance)
        found = []
        for tag in tags:
            if tag not in old and arrival:
                found.append(_event(arrival, self._now[tag], alliance))
            elif tag in changed:
                found.append(changed[tag])
        return found

    def _changed_as(self, alliance: Alliance) -> dict[str, Event]:
        """Return the changes of health as events of one alliance; made once, for all teams that witness them."""
        if alliance not in self._changed:
            made = {}
            for tag, change in self.changes.items():
                what: EventKind = "hurt" if change < 0 else "healed"
                made[tag] = _event(what, self._now[tag], alliance, round(abs(change), 1))
            self._changed[alliance] = made
        return self._changed[alliance]


def _event(what: EventKind, unit: UnitView, alliance: Alliance, amount: float | None = None) -> Event:
    """Return an event of a unit; unchecked, since a battle has hundreds in each step."""
    return _NOTHING.having({"what": what, "tag": unit.tag, "type": unit.type, "alliance": alliance, "amount": amount})
