"""What a rule is asked, and what it answers: orders, or why there are none.

Rules are pure functions of a snapshot and the ledger of the turn; the ground is found by the snapshot. Above them is
`khala_bridge.act.translate`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from khala_bridge.knowledge import abilities, ability_of

if TYPE_CHECKING:
    from khala_bridge.catalogue.action import Action
    from khala_bridge.catalogue.functions import Function
    from khala_bridge.frames import WorldPoint
    from khala_bridge.knowledge import AbilityFacts
    from khala_bridge.state import Snapshot
    from khala_bridge.state.ledger import Ledger
    from khala_protocol.messages import RejectionReason


@dataclass(frozen=True, slots=True)
class Ask:
    """An action, and what the words of the agent left to find out."""

    action: Action
    snapshot: Snapshot
    ledger: Ledger
    units: tuple[int, ...] = ()
    """Those of the team that are alive, or the unit that was named; () for a side team."""
    tag: int | None = None
    """The unit among the arguments that is the target or says where."""
    point: WorldPoint | None = None

    @property
    def function(self) -> Function:
        """What the action ends in; actions with a rule end in something."""
        function = self.action.pysc2
        assert function is not None, f"{self.action.name} has a rule and no function"
        return function

    def facts(self, unit_type: str) -> AbilityFacts | None:
        """What is known of the action's ability, by the type of its user where that makes a difference."""
        return ability_of(self.function.ability_id, unit_type) or abilities().get(self.function.ability_id)

    def facts_of(self, unit_type: str) -> AbilityFacts | None:
        """What the action's ability is for a type of unit, if the type has it."""
        return ability_of(self.function.ability_id, unit_type)

    def has(self, tag: int) -> bool:
        """Whether the game would take the action's ability from a unit now; true if the game was not asked."""
        return self.can(tag, self.function.ability_id)

    def can(self, tag: int, ability: int) -> bool:
        """Whether the game would take an ability from a unit now; true if the game was not asked."""
        known = self.snapshot.abilities
        return known is None or ability in known.get(tag, ())


@dataclass(frozen=True, slots=True)
class Order:
    """A function for some units."""

    function: Function
    units: tuple[int, ...]
    target: int | WorldPoint | None = None
    """Tag of a unit, or a point of the world."""
    queued: bool = False


class Impossible(Exception):
    """There is nothing that the rule could answer; the message is a sentence for the model."""

    def __init__(self, reason: RejectionReason, message: str, place: WorldPoint | None = None) -> None:
        self.reason, self.message = reason, message
        self.place = place
        """The nearest place at which it would be possible, where there is one and the agent named another."""
        super().__init__(message)


Rule: TypeAlias = Callable[[Ask], list[Order]]


def never(ask: Ask, why: str) -> Impossible:
    """What stands in the way now, as an error to raise: `Build_Pylon is not possible now: <why>`."""
    return Impossible("not_available", f"{ask.action.name} is not possible now: {why}")
