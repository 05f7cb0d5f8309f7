"""The resources and units that are left for a joint action, while the calls of all agents become commands.

Two agents that spend the same minerals, or send the same worker, learn it in the same turn. The game takes the price
of a structure when its construction begins. Until then, while the worker is on its way, the price is set aside, so
that an order of this turn does not undo one of an earlier turn. `khala_bridge.state.means.ledger_of` opens the
accounts of a snapshot.
"""

from __future__ import annotations

from collections import Counter
from copy import copy
from dataclasses import dataclass, field, fields
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
    """Minerals and vespene set aside for structures that workers are on their way to build; not part of the above."""
    busy: set[int] = field(default_factory=set)
    """Tags of the units that an earlier call of this turn took."""
    sites: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Ground that an earlier call of this turn is going to build on: x0, y0, x1, y1 in the world."""
    queued: Counter[int] = field(default_factory=Counter)
    """Number of orders that earlier calls of this turn put into the queue of a producer, by its tag."""
    changing: set[int] = field(default_factory=set)
    """Structures that an earlier call of this turn turns into something else, by their tags."""
    energy: Counter[int] = field(default_factory=Counter)
    """Energy that earlier calls of this turn spend, by the tag of the caster."""
    aimed: set[tuple[str, int]] = field(default_factory=set)
    """Targets of earlier calls of this turn that need only one call: (function, tag)."""
    looks: list[tuple[float, float]] = field(default_factory=list)
    """Points of the world that an earlier call of this turn sent a scout to."""
    begun: set[int] = field(default_factory=set)
    """Research abilities that an earlier call of this turn began: nothing is researched twice."""

    def copy(self) -> Ledger:
        """Return accounts of the same content, which change by themselves."""
        return Ledger(*(copy(getattr(self, account.name)) for account in fields(self)))

    def short_of(self, cost: Cost) -> tuple[Shortfall, ...]:
        """Return the accounts that do not suffice for a price, with the shortfalls."""
        if cost.minerals <= self.minerals and cost.vespene <= self.vespene and cost.supply <= self.supply:
            return ()
        left = (self.minerals, self.vespene, self.supply)
        accounts = zip(cost._fields, cost, left, (*self.aside, 0.0), strict=True)
        return tuple(Shortfall(what, needs, has, aside) for what, needs, has, aside in accounts if needs > max(has, 0))

    def times(self, cost: Cost) -> int:
        """Return how often the accounts could pay a price that is not 0."""
        left = (self.minerals, self.vespene, self.supply)
        return max(0, min(int(has // needs) for has, needs in zip(left, cost, strict=True) if needs > 0))

    def payable(self, costs: Iterable[Cost]) -> int:
        """Return how many of the first prices the accounts can pay one after the other."""
        rest = Ledger(self.minerals, self.vespene, self.supply)
        paid = 0
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
        """Note that these units have an order in this turn."""
        self.busy.update(tags)

    def promise(self, middle: WorldPoint, width: float, height: float) -> None:
        """Note that a structure is going to stand around a point."""
        self.sites.append((middle.x - width / 2, middle.y - height / 2, middle.x + width / 2, middle.y + height / 2))
