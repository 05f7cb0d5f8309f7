"""What one joint action may still spend and use, while the calls of all agents are turned into commands.

Two agents that spend the same minerals, or send the same worker, are told so in the turn in which they try. What
workers are on their way to build is not paid for yet, the game takes the price when it is begun; it is set aside, so
that an order of this turn does not undo one of an earlier turn.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

from khala_bridge.knowledge import knowledge
from khala_bridge.state.ground import land_of

if TYPE_CHECKING:
    from khala_bridge.frames import WorldPoint
    from khala_bridge.state import Snapshot


@dataclass(slots=True)
class Ledger:
    """The accounts of one joint action."""

    minerals: float
    vespene: float
    supply: float
    """Supply that is free."""
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

    @classmethod
    def of(cls, snapshot: Snapshot) -> Self:
        """The accounts at the beginning of a joint action."""
        common = snapshot.player
        minerals, vespene = _planned(snapshot)
        return cls(
            max(common.minerals - minerals, 0.0),
            max(common.vespene - vespene, 0.0),
            float(common.food_cap) - float(common.food_used),
            (min(minerals, common.minerals), min(vespene, common.vespene)),
        )

    def pay(self, minerals: float, vespene: float, supply: float = 0.0) -> None:
        """Takes a price from the accounts."""
        self.minerals -= minerals
        self.vespene -= vespene
        self.supply -= supply

    def take(self, *tags: int) -> None:
        """Notes that these units have something to do in this turn."""
        self.busy.update(tags)

    def promise(self, middle: WorldPoint, width: float, height: float) -> None:
        """Notes that something is going to stand around a point."""
        self.sites.append((middle.x - width / 2, middle.y - height / 2, middle.x + width / 2, middle.y + height / 2))


def _planned(snapshot: Snapshot) -> tuple[float, float]:
    """Minerals and vespene that structures will cost which workers are on their way to build."""
    plans = [knowledge()[structure] for structure, _ in land_of(snapshot).plans]
    drones = sum(knowledge()["Drone"].minerals for kind in plans if kind.race == "zerg")
    return sum(kind.minerals for kind in plans) - drones, sum(kind.vespene for kind in plans)
