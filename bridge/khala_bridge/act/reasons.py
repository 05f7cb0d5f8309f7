"""Why the game does not let a unit do something, worked out from the state and from what is known of the ability.

Each reason is a function that gives the end of a sentence for a model, or None; of several the first one of `REASONS`
is told:

    it is under construction · a structure, an addon or an upgrade is missing · energy · minerals, vespene, supply ·
    its queue is full · it has no power · it is cooling down · the game does not allow it

The last two are inferred: the game shows neither the cooldown of an ability nor all that it looks at.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from khala_bridge.knowledge import abilities, ability_of, is_armed, knowledge, stand_ins
from khala_bridge.state.abilities import ATTACK, is_attack

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.auto import Ledger
    from khala_bridge.catalogue.functions import Function
    from khala_bridge.knowledge import AbilityFacts
    from khala_bridge.state import Snapshot, Unit

SCAN_MOVE = 19
"""What units without a weapon do when they are told to attack: they walk there."""
QUEUE_LENGTH = 5
"""Orders that a structure can hold, the one at work among them; with a Reactor 8."""
WITH_REACTOR = 8
FINISHED = 1.0
"""Build progress of what is finished."""


class Cost(NamedTuple):
    """What a use takes from the accounts."""

    minerals: float
    vespene: float
    supply: float


class Means:
    """What a side has at one moment: its accounts, its structures, its upgrades."""

    def __init__(self, snapshot: Snapshot, ledger: Ledger) -> None:
        """Takes the state and what the turn may still spend."""
        self._snapshot = snapshot
        self.ledger = ledger

    @functools.cached_property
    def upgrades(self) -> frozenset[str]:
        """Names of the upgrades that the player has."""
        return frozenset(self._snapshot.upgrades)

    @functools.cached_property
    def standing(self) -> frozenset[str]:
        """Types of the player's finished units and structures."""
        return frozenset(unit.name for unit in self._snapshot.own if unit.build_progress >= FINISHED)

    def has(self, requirement: str) -> bool:
        """Whether the side has a structure or an upgrade, or what may stand in for it."""
        if requirement in knowledge():
            return not self.standing.isdisjoint(stand_ins(requirement))
        return requirement in self.upgrades

    def addon(self, unit: Unit) -> str:
        """Type of what is attached to a unit; empty for nothing."""
        found = self._snapshot.units.get(unit.add_on_tag)
        return found.name if found is not None else ""


Reason: TypeAlias = "Callable[[Means, AbilityFacts, Unit, str], str | None]"
"""From means, ability, unit and the name of its type to the end of a sentence."""


def under_construction(_: Means, __: AbilityFacts, unit: Unit, name: str) -> str | None:
    """It is not there yet."""
    if unit.build_progress >= FINISHED:
        return None
    return f"{name} is still under construction ({unit.build_progress:.0%})"


def tech(means: Means, facts: AbilityFacts, unit: Unit, name: str) -> str | None:
    """A structure, an addon or an upgrade is missing, or the research is done."""
    missing = [need for need in facts.requires if not means.has(need)]
    if structures := [need for need in missing if need in knowledge()]:
        return f"a finished {' and a '.join(structures)} is needed first"
    if missing:
        return f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} not researched"
    if facts.researches and facts.researches in means.upgrades:
        return f"{facts.researches} is researched already"
    if facts.addon and not means.addon(unit).endswith(facts.addon):
        return f"{name} needs a {facts.addon} for it"
    return None


def energy(means: Means, facts: AbilityFacts, unit: Unit, name: str) -> str | None:
    """It has too little energy, after what earlier calls of the turn took."""
    left = unit.energy - means.ledger.energy[unit.tag]
    return None if facts.energy <= left else f"{name} has {int(left)} energy and it takes {facts.energy:g}"


def price(means: Means, facts: AbilityFacts, _: Unit, name: str) -> str | None:
    """Minerals, vespene or supply do not suffice, after what earlier calls of the turn took."""
    cost = cost_of(facts.id, name)
    return None if cost is None else too_dear(means.ledger, cost)


def too_dear(ledger: Ledger, cost: Cost) -> str | None:
    """What a ledger lacks for a price, as the end of a sentence; None if it is there."""
    accounts = (
        ("minerals", cost.minerals, ledger.minerals, ledger.aside[0]),
        ("vespene", cost.vespene, ledger.vespene, ledger.aside[1]),
        ("supply", cost.supply, ledger.supply, 0.0),
    )
    for what, amount, account, aside in accounts:
        left = max(account, 0.0)
        if amount > left:
            waits = f", {aside:g} more are for what workers are on their way to build" if aside else ""
            return f"it takes {amount:g} {what} and {left:g} {'are' if what == 'minerals' else 'is'} left{waits}"
    return None


def queue(means: Means, facts: AbilityFacts, unit: Unit, name: str) -> str | None:
    """Its queue of production is full."""
    places = WITH_REACTOR if means.addon(unit).endswith("Reactor") else QUEUE_LENGTH
    full = facts.does in ("train", "research") and len(unit.orders) >= places
    return f"the queue of {name} is full" if full else None


def power(_: Means, __: AbilityFacts, unit: Unit, name: str) -> str | None:
    """No Pylon powers it."""
    known = knowledge().get(name)
    return f"{name} has no power" if known and known.needs_power and not unit.is_powered else None


def cooldown(_: Means, facts: AbilityFacts, __: Unit, name: str) -> str | None:
    """It was used a short while ago."""
    return f"{name} cannot again so soon, it takes {facts.cooldown_s:g} s after each use" if facts.cooldown_s else None


def otherwise(_: Means, __: AbilityFacts, unit: Unit, name: str) -> str | None:
    """Nothing that is known speaks against it, but the game does."""
    doing = f" while it has {len(unit.orders)} orders" if len(unit.orders) > 1 else ""
    return f"the game does not let {name} do it now{doing}"


REASONS: tuple[Reason, ...] = (under_construction, tech, energy, price, queue, power, cooldown, otherwise)
"""In the order in which they are tried."""


def can_shoot(name: str, able: frozenset[int]) -> bool:
    """Whether a unit that the game lets attack has a weapon now.

    Those without one scan on the same order: they go where others would shoot. Bunkers, and Oracles with their beam,
    shoot though their type has no weapon of its own.
    """
    return is_armed(name) or not able.isdisjoint(_shots())


@functools.cache
def _shots() -> frozenset[int]:
    return frozenset(abilities()[ATTACK].special) - {SCAN_MOVE}


def incapable(function: Function, name: str) -> str:
    """Why a type can never do it."""
    return f"{name} has no weapon" if is_attack(function) and not is_armed(name) else f"{name} has no such ability"


@functools.cache
def facts_of(ability: int, name: str) -> AbilityFacts | None:
    """What is known of an ability for a type of unit."""
    return ability_of(ability, name)


@functools.cache
def cost_of(ability: int, name: str) -> Cost | None:
    """What the use of an ability by a type of unit costs; None if it is free.

    What a unit becomes takes supply only above its own.
    """
    facts, before = facts_of(ability, name), knowledge().get(name)
    if facts is None:
        return None
    made = knowledge().get(facts.produces or "")
    own = before.supply if before is not None and not before.structure else 0.0
    supply = 0.0 if made is None or made.structure else max(facts.supply - own, 0.0)
    cost = Cost(facts.minerals, facts.vespene, supply)
    return cost if any(cost) else None
