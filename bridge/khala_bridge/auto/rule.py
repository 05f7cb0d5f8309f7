"""The question to a rule, and its answer: orders, or why there are none.

Rules are pure functions of a snapshot and the ledger of the turn; the snapshot leads to the ground. Above them is
`khala_bridge.act.translate`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from khala_bridge.rules import asked_by, brief, facts_for, nearest, nobody, of_side, price_of, why_not
from khala_bridge.state.means import side_of

if TYPE_CHECKING:
    from khala_bridge.catalogue.action import Action
    from khala_bridge.catalogue.functions import Function
    from khala_bridge.frames import WorldPoint
    from khala_bridge.knowledge import AbilityFacts
    from khala_bridge.rules import Ledger, SideState, Unavailable, UnitState
    from khala_bridge.state import Snapshot
    from khala_protocol.messages import RejectionReason


@dataclass(frozen=True, slots=True)
class RuleRequest:
    """An action, and the arguments that the agent gave."""

    action: Action
    snapshot: Snapshot
    ledger: Ledger
    units: tuple[int, ...] = ()
    """The living units of the team, or the named unit; () for a side team."""
    tag: int | None = None
    """The unit among the arguments that is the target or names the place."""
    point: WorldPoint | None = None

    @property
    def function(self) -> Function:
        """The function that the action ends in; every action with a rule has one."""
        function = self.action.pysc2
        assert function is not None, f"{self.action.name} has a rule and no function"
        return function

    def facts(self, unit_type: str) -> AbilityFacts | None:
        """Return the facts of the action's ability, by the type of its user where that makes a difference."""
        number = self.function.ability_id
        return facts_for(self.snapshot.facts, number, unit_type, self.side.upgrades) or self.ability

    @property
    def ability(self) -> AbilityFacts | None:
        """The facts of the action's ability, whoever uses it."""
        return self.snapshot.facts.abilities.get(self.function.ability_id)

    @property
    def side(self) -> SideState:
        """The player's side, as `khala_bridge.rules` knows it."""
        return side_of(self.snapshot)

    def able(self) -> list[UnitState]:
        """Return the units that can do it now, of those that the call names or of the side; at least one.

        Raises:
            NotAvailable: no unit can.
        """
        use = asked_by(self.action, of_side=not self.units)
        assert use is not None, f"{self.action.name} has a rule and no function"
        side = self.side
        types = self.action.units or self._users()
        units = [side.units[tag] for tag in self.units if tag in side.units] if self.units else side.of_types(types)
        judged = [(unit, why_not(use, unit, side, self.ledger)) for unit in units]
        able = [unit for unit, why in judged if why is None]
        if not able:
            reasons = [why for _, why in judged if why is not None]
            raise not_available(self, nearest(reasons) if reasons else nobody(types))
        return able

    def charge(self, facts: AbilityFacts | None) -> None:
        """Take the price of an ability from the ledger."""
        if facts is not None:
            self.ledger.pay(price_of(facts))

    def has(self, tag: int) -> bool:
        """Return True if the game would take the action's ability from a unit now, or if it was not asked."""
        return self.can(tag, self.function.ability_id)

    def can(self, tag: int, ability: int) -> bool:
        """Return True if the game would take an ability from a unit now, or if it was not asked."""
        known = self.snapshot.abilities
        return known is None or ability in known.get(tag, ())

    def _users(self) -> tuple[str, ...]:
        return self.ability.users if self.ability else ()


@dataclass(frozen=True, slots=True)
class RuleOrder:
    """A function for some units."""

    function: Function
    units: tuple[int, ...]
    target: int | WorldPoint | None = None
    """Tag of a unit, or a point of the world."""
    queued: bool = False


class NotAvailable(Exception):
    """The rule finds no order; the message tells the model why."""

    def __init__(
        self,
        reason: RejectionReason,
        message: str,
        place: WorldPoint | None = None,
        why: Unavailable | None = None,
        lack: str = "",
    ) -> None:
        self.reason, self.message = reason, message
        self.lack = lack or (brief(why) if why else "")
        """The reason in the shortest form, for the list of what is not possible; "" if it depends on the arguments."""
        self.why = why
        """The judgement of `khala_bridge.rules`; None if the rule found no place or target."""
        self.place = place
        """The nearest place at which it would be possible, where there is one and the agent named another."""
        super().__init__(message)


Rule: TypeAlias = Callable[[RuleRequest], list[RuleOrder]]


Check: TypeAlias = Callable[[RuleRequest], object]
"""The part of a rule that may find nothing, whatever the arguments: it raises `NotAvailable`, or returns."""


def not_available(ask: RuleRequest, why: str | Unavailable, lack: str = "") -> NotAvailable:
    """Return the error to raise if something stands in the way: `Build_Pylon is not possible now: <why>`.

    Args:
        ask: the question.
        why: a sentence for a refusal, or the judgement.
        lack: the same in the shortest form; the one of a judgement is known.
    """
    said, judged = (why, None) if isinstance(why, str) else (of_side(why), why)
    return NotAvailable("not_available", f"{ask.action.name} is not possible now: {said}", why=judged, lack=lack)
