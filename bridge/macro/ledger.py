"""What one joint action may still spend and use, while the calls of all agents are turned into commands.

Two agents that spend the same minerals, or send the same worker, are told so in the turn in which they try.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from bridge.snapshot import Snapshot


@dataclass(slots=True)
class Ledger:
    """The accounts of one joint action."""

    minerals: float
    vespene: float
    supply: float
    """Supply that is free."""
    busy: set[int] = field(default_factory=set)
    """Tags of the units that an earlier call of this turn took."""
    sites: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Ground that an earlier call of this turn is going to build on: x0, y0, x1, y1 in the world."""

    @classmethod
    def of(cls, snapshot: Snapshot) -> Self:
        """The accounts at the beginning of a joint action."""
        common = snapshot.response.observation.player_common
        return cls(float(common.minerals), float(common.vespene), float(common.food_cap) - float(common.food_used))

    def pay(self, minerals: float, vespene: float, supply: float = 0.0) -> None:
        """Takes a price from the accounts."""
        self.minerals -= minerals
        self.vespene -= vespene
        self.supply -= supply
