"""What happened to the units of a team's screen between two observations.

Compares two views of the same team; a view does not say who died, so the game's list of the dead is asked. An
enemy that is neither in sight nor among the dead has walked out of sight, which is another event.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

from protocol.messages import Event

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from protocol.messages import TeamView, UnitView

EventKind: TypeAlias = Literal["hurt", "healed", "died", "joined", "appeared", "disappeared"]

MIN_CHANGE = 1.0
"""Health and shield that make an event; Protoss shields regain less than that between two quick observations."""


def events(before: TeamView | None, now: TeamView, dead: Collection[str]) -> tuple[Event, ...]:
    """Events of a team in the order of its units; () for a team that is seen for the first time.

    Args:
        before: the team's view at the observation before, None if it had none.
        now: its view now; its own events are not looked at.
        dead: tags of the units that died in between.
    """
    if before is None:
        return ()
    old = {unit.tag: unit for unit in _all(before)}
    return (*_changes(old, now), *_losses(old, now, dead))


def _all(view: TeamView) -> Iterable[UnitView]:
    return (*view.units, *view.allies, *view.enemies)


def _changes(old: dict[str, UnitView], now: TeamView) -> Iterator[Event]:
    members = {unit.tag for unit in now.units}
    for unit in _all(now):
        earlier = old.get(unit.tag)
        if earlier is None or (unit.tag in members and earlier.alliance != unit.alliance):
            yield _event("joined" if unit.tag in members else "appeared", unit)
            continue
        change = unit.health + unit.shield - earlier.health - earlier.shield
        if abs(change) >= MIN_CHANGE:
            yield _event("hurt" if change < 0 else "healed", unit, round(abs(change), 1))


def _losses(old: dict[str, UnitView], now: TeamView, dead: Collection[str]) -> Iterator[Event]:
    still = {unit.tag for unit in _all(now)}
    for tag, unit in old.items():
        if tag in still:
            continue
        yield _event("died" if tag in dead else "disappeared", unit)


def _event(what: EventKind, unit: UnitView, amount: float | None = None) -> Event:
    return Event(what=what, tag=unit.tag, type=unit.type, alliance=unit.alliance, amount=amount)
