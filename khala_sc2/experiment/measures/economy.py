"""How a side of a full game kept house, as its agents saw it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from khala_bridge.knowledge import knowledge

if TYPE_CHECKING:
    from khala_sc2.experiment.measures.evidence import CountsGlance, ViewGlance

MAX_SUPPLY = 200
"""The most supply that a side can have in a melee game."""
FIVE_MINUTES_S = 300.0
HALLS = frozenset({"Nexus", "CommandCenter", "Hatchery"})
"""The first town hall of each race; others count as one of them."""


@dataclass(frozen=True, kw_only=True)
class EconomyMeasures:
    """Economy of a full game. All None if no agent of the side ever saw a town hall of its own in its counts.

    Commanders, developers and builders have these numbers in their observations. What one observation says holds until
    the next one, of any of them.
    """

    supply_blocked_s: float | None
    """Seconds of the game in which all supply was used, and the cap was below the game's 200."""
    minerals_mean: float | None
    """Unspent minerals, mean over time."""
    vespene_mean: float | None
    """Unspent vespene, mean over time."""
    expansion_s: float | None
    """Seconds on the game's clock at which there was first seen to be a town hall more than at the beginning, under
    construction or finished; None if there was none."""
    workers_5min: int | None
    """Finished workers at 5:00 on the game's clock; None if the episode ended before."""
    army_supply_5min: float | None
    """Supply that is used by all but workers, finished or in training, at 5:00; None if the episode ended before."""
    workers_end: int | None
    """Finished workers in the last observation."""
    army_supply_end: float | None
    """Supply that is used by all but workers, finished or in training, in the last observation."""
    bases_end: int | None
    """Finished town halls in the last observation."""


@dataclass(frozen=True, slots=True)
class _State:
    """The economy at one moment."""

    time_s: float
    minerals: int
    vespene: int
    blocked: bool
    workers: int
    army_supply: float
    halls: int
    """Finished or not."""
    bases: int
    """Finished."""


class EconomyTally:
    """The running account of an episode."""

    def __init__(self) -> None:
        self._first: _State | None = None
        self._last: _State | None = None
        self._at_five: _State | None = None
        self._expansion_s: float | None = None
        self._had_hall = False
        self._over_s = self._blocked_s = self._mineral_s = self._vespene_s = 0.0

    def see(self, view: ViewGlance) -> None:
        """Take in what one agent sees; agents that see no counts say nothing."""
        if view.counts is None or (self._last is not None and view.time_s <= self._last.time_s):
            return
        state = _state(view, view.counts)
        self._until(state.time_s)
        self._first, self._last = self._first or state, state
        self._had_hall |= state.halls > 0
        if self._at_five is None and state.time_s >= FIVE_MINUTES_S:
            self._at_five = state
        if self._expansion_s is None and state.halls > self._first.halls:
            self._expansion_s = state.time_s

    def _until(self, time_s: float) -> None:
        """Weigh the last state by the time for which it held."""
        if self._last is None:
            return
        held_s = max(0.0, time_s - self._last.time_s)
        self._over_s += held_s
        self._blocked_s += held_s * self._last.blocked
        self._mineral_s += held_s * self._last.minerals
        self._vespene_s += held_s * self._last.vespene

    def total(self, end_s: float) -> EconomyMeasures:
        """Return the group of an episode that ended at a time of the game; nothing can be added afterwards."""
        if self._last is None or not self._had_hall:
            return _NONE
        self._until(end_s)
        five, last = self._at_five, self._last
        return EconomyMeasures(
            supply_blocked_s=round(self._blocked_s, 3),
            minerals_mean=self._mineral_s / self._over_s if self._over_s else float(last.minerals),
            vespene_mean=self._vespene_s / self._over_s if self._over_s else float(last.vespene),
            expansion_s=self._expansion_s,
            workers_5min=five.workers if five else None,
            army_supply_5min=five.army_supply if five else None,
            workers_end=last.workers,
            army_supply_end=last.army_supply,
            bases_end=last.bases,
        )


_NONE = EconomyMeasures(
    supply_blocked_s=None,
    minerals_mean=None,
    vespene_mean=None,
    expansion_s=None,
    workers_5min=None,
    army_supply_5min=None,
    workers_end=None,
    army_supply_end=None,
    bases_end=None,
)


def _state(view: ViewGlance, counts: CountsGlance) -> _State:
    has = view.resources
    workers = sum(count.ready for count in counts.units if _is_worker(count.type))
    training = sum(len(made.progress) for made in counts.production if _is_worker(made.order.removeprefix("Train_")))
    halls = [count for count in counts.structures if _is_hall(count.type)]
    return _State(
        time_s=view.time_s,
        minerals=has.minerals,
        vespene=has.vespene,
        blocked=has.supply_used >= has.supply_cap and has.supply_cap < MAX_SUPPLY,
        workers=workers,
        army_supply=has.supply_used - workers - training,
        halls=sum(hall.ready + len(hall.under_way) for hall in halls),
        bases=sum(hall.ready for hall in halls),
    )


@cache
def _is_worker(name: str) -> bool:
    """Return True for a type that gathers and uses a supply of 1, which a MULE does not."""
    known = knowledge().get(name)
    return known is not None and known.worker and known.supply > 0


@cache
def _is_hall(name: str) -> bool:
    known = knowledge().get(name)
    return known is not None and not HALLS.isdisjoint({name, *known.counts_as})
