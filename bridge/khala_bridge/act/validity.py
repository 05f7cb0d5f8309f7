"""Whether these very units may do it now: what the game says, and what the turn has left.

The judge is the game (`Snapshot.abilities`), which is asked once an observation; why it says no is worked out by
`khala_bridge.act.reasons`. What earlier calls of the same turn took from the accounts is gone, so that a price can be
refused that the game would still take. Where the game was not asked, only what is sure is refused: a weapon or an
upgrade that is not there. Range is no reason, since units walk.

What a target has to be is judged by `khala_bridge.act.targets`. Above both is `khala_bridge.act.translate`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.act.reasons import REASONS, Means, can_shoot, cost_of, energy, facts_of, incapable, price, too_dear
from khala_bridge.knowledge import is_armed
from khala_bridge.state.abilities import is_attack, unmet

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_bridge.auto import Ledger
    from khala_bridge.catalogue.action import Action
    from khala_bridge.catalogue.functions import Function
    from khala_bridge.state import Snapshot, Unit


class Obstacle(NamedTuple):
    """What stands in the way of one unit."""

    rank: int
    """Place in the order of reasons; the higher, the nearer the unit is to being able."""
    energy: float
    """Of the unit: of two that have too little, the one that has more is spoken of."""
    text: str
    """The end of a sentence: `Stalker has no such ability`."""


class Validity:
    """What the units of a side may do at one moment, with the accounts of the turn."""

    def __init__(self, snapshot: Snapshot, ledger: Ledger) -> None:
        """Takes what the game said, and what the turn may still spend."""
        self._abilities = snapshot.abilities
        self._means = Means(snapshot, ledger)

    def obstacle(self, action: Action, function: Function, unit: Unit) -> Obstacle | None:
        """What stands in the way of a unit's doing an action with this function now; None if nothing does."""
        name = unit.name
        able = None if self._abilities is None else self._abilities.get(unit.tag)
        if able is not None and function.ability_id in able:
            if is_attack(function) and action.target_kind == "tag" and not can_shoot(name, able):
                return Obstacle(0, unit.energy, incapable(function, name))
            return self._spent(function, unit, name)
        facts = facts_of(function.ability_id, name)
        if able is None or function.kind == "autocast":  # the game is not asked about switches
            reason = unmet(function, name, self._means.upgrades)
            return None if reason is None else Obstacle(0, unit.energy, reason)
        if facts is None or (is_attack(function) and not is_armed(name)):
            return Obstacle(0, unit.energy, incapable(function, name))
        found = ((rank, reason(self._means, facts, unit, name)) for rank, reason in enumerate(REASONS, start=1))
        return next(Obstacle(rank, unit.energy, text) for rank, text in found if text is not None)

    def affordable(self, function: Function, units: Sequence[Unit]) -> tuple[int, ...]:
        """Tags of those of some units, the first ones, for which the accounts suffice if each pays for itself."""
        purse = self._means.ledger.minerals, self._means.ledger.vespene, self._means.ledger.supply
        found = []
        for unit in units:
            cost = cost_of(function.ability_id, unit.name) if self._abilities is not None else None
            if cost is not None:
                purse = purse[0] - cost.minerals, purse[1] - cost.vespene, purse[2] - cost.supply
                if any(left < 0 < price for left, price in zip(purse, cost, strict=True)):
                    break
            found.append(unit.tag)
        return tuple(found)

    def pay(self, function: Function, units: Sequence[Unit]) -> None:
        """Takes what the use of a function by some units costs from the accounts of the turn.

        Energy only of a single unit: of a group that casts at one target, the game chooses who does it.
        """
        for unit in units:
            name = unit.name
            if cost := cost_of(function.ability_id, name):
                self._means.ledger.pay(*cost)
            if len(units) == 1 and (facts := facts_of(function.ability_id, name)) and facts.energy:
                self._means.ledger.energy[unit.tag] += int(facts.energy)

    def _spent(self, function: Function, unit: Unit, name: str) -> Obstacle | None:
        """What earlier calls of the turn took away of what the game would still allow."""
        cost, facts = cost_of(function.ability_id, name), facts_of(function.ability_id, name)
        if cost and (dear := too_dear(self._means.ledger, cost)):
            return Obstacle(REASONS.index(price) + 1, unit.energy, dear)
        if facts and facts.energy and (tired := energy(self._means, facts, unit, name)):
            return Obstacle(REASONS.index(energy) + 1, unit.energy, tired)
        return None
