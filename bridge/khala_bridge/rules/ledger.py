"""What one joint action may still spend and use, while the calls of all agents are turned into commands.

Two agents that spend the same minerals, or send the same worker, learn it in the turn in which they try. What workers
are on their way to build is not paid for yet, the game takes the price when it is begun; it is set aside, so that an
order of this turn does not undo one of an earlier turn. `khala_bridge.state.means.ledger_of` opens the accounts of a
snapshot.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_bridge.rules.cost import Shortfall

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.frames import WorldPoint
    from khala_bridge.rules.cost import Cost


@dataclass(slots=True)
class Ledger:
    """The accounts of one joint action."""

    minerals: float
    vespene: float
    supply: float
    """Supply that is free; less than 0 above the cap."""
    aside: tuple[float, float] = (0.0, 0.0)
    """Minerals and vespene that are set aside for what workers are on their way to build; no part of the above."""
    busy: set[int] = field(default_factory=set)
    """Tags of the units that an earlier call of this turn took."""
    sites: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Ground that an earlier call of this turn is going to build on: x0, y0, x1, y1 in the world."""
    queued: Counter[int] = field(default_factory=Counter)
    """How many orders earlier calls of this turn put into the queue of a producer, by its tag."""
    changing: set[int] = field(default_factory=set)
    """Structures that an earlier call of this turn turns into something else, by their tags."""
    energy: Counter[int] = field(default_factory=Counter)
    """Energy that earlier calls of this turn spend, by the tag of the caster."""
    aimed: set[tuple[str, int]] = field(default_factory=set)
    """What an earlier call of this turn is already aimed at, where once is enough: (function, tag)."""
    looks: list[tuple[float, float]] = field(default_factory=list)
    """Points of the world that an earlier call of this turn sent a scout to."""
    begun: set[int] = field(default_factory=set)
    """Abilities of research that an earlier call of this turn began: nothing is researched twice."""

    def short_of(self, cost: Cost) -> tuple[Shortfall, ...]:
        """Return the accounts that do not suffice for a price, with what they lack."""
        if cost.minerals <= self.minerals and cost.vespene <= self.vespene and cost.supply <= self.supply:
            return ()
        left = (self.minerals, self.vespene, self.supply)
        accounts = zip(cost._fields, cost, left, (*self.aside, 0.0), strict=True)
        return tuple(Shortfall(what, needs, has, aside) for what, needs, has, aside in accounts if needs > max(has, 0))

    def times(self, cost: Cost) -> int:
        """Return how often a price that is not free could be paid."""
        left = (self.minerals, self.vespene, self.supply)
        return max(0, min(int(has // needs) for has, needs in zip(left, cost, strict=True) if needs > 0))

    def payable(self, costs: Iterable[Cost]) -> int:
        """Return how many of some prices, the first ones, can be paid one after the other."""
        rest, paid = Ledger(self.minerals, self.vespene, self.supply), 0
        for cost in costs:
            if rest.short_of(cost):
                break
            rest.pay(cost)
            paid += 1
        return paid

    def pay(self, cost: Cost) -> None:
        """Take a price from the accounts."""
        self.minerals -= cost.minerals
        self.vespene -= cost.vespene
        self.supply -= cost.supply

    def take(self, *tags: int) -> None:
        """Note that these units have something to do in this turn."""
        self.busy.update(tags)

    def promise(self, middle: WorldPoint, width: float, height: float) -> None:
        """Note that something is going to stand around a point."""
        self.sites.append((middle.x - width / 2, middle.y - height / 2, middle.x + width / 2, middle.y + height / 2))
