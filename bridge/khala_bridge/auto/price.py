"""What an order costs and needs, against what the turn has left; and the sentences that say what is missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.auto.rule import never
from khala_bridge.knowledge import knowledge, upgrades
from khala_bridge.state.side import has_upgrade, stands

if TYPE_CHECKING:
    from khala_bridge.auto.rule import Ask
    from khala_bridge.knowledge import AbilityFacts

SUPPLY_FROM = {"protoss": "a Pylon", "terran": "a SupplyDepot", "zerg": "an Overlord"}


def require(ask: Ask, facts: AbilityFacts) -> None:
    """Checks that every structure and upgrade that an ability needs is there; the game's own word comes first.

    Raises:
        Impossible: one is missing.
    """
    if any(ask.function.ability_id in can for can in (ask.snapshot.abilities or {}).values()):
        return
    lacking = [name for name in facts.requires if not _is_there(ask, name)]
    if lacking:
        raise never(ask, f"it needs {_listed(lacking)} first.")


def check(ask: Ask, facts: AbilityFacts, user: str) -> None:
    """Checks that the price of an ability is there.

    Args:
        ask: what is asked.
        facts: of the ability.
        user: type of the unit that uses it; the supply of what it becomes counts only above its own.

    Raises:
        Impossible: there is not enough.
    """
    ledger = ask.ledger
    accounts = (
        ("minerals", facts.minerals, ledger.minerals, ledger.aside[0]),
        ("vespene", facts.vespene, ledger.vespene, ledger.aside[1]),
    )
    for what, cost, left, aside in accounts:
        if cost > left:
            waits = f", {aside:g} more are for what workers are on their way to build" if aside else ""
            raise never(ask, f"it costs {cost:g} {what} and {max(left, 0):g} are left{waits}.")
    supply = supply_of(facts, user)
    if supply > max(ledger.supply, 0):
        known = knowledge().get(user)
        more = SUPPLY_FROM.get(known.race if known else "", "more supply")
        raise never(ask, f"it needs {supply:g} supply and {max(ledger.supply, 0):g} is free; get {more} first.")


def charge(ask: Ask, facts: AbilityFacts, user: str) -> None:
    """Takes the price of an ability from the ledger; the arguments and errors are those of `check`."""
    check(ask, facts, user)
    ask.ledger.pay(facts.minerals, facts.vespene, supply_of(facts, user))


def supply_of(facts: AbilityFacts, user: str) -> float:
    """Supply that the use of an ability adds."""
    made, before = knowledge().get(facts.produces or ""), knowledge().get(user)
    if made is None or before is None or made.structure:
        return 0.0
    own = 0.0 if before.structure else before.supply
    return max(facts.supply - own, 0.0)


def _is_there(ask: Ask, name: str) -> bool:
    return has_upgrade(ask.snapshot, name) if name in upgrades() else stands(ask.snapshot, name)


def _listed(names: list[str]) -> str:
    written = [f"the upgrade {name}" if name in upgrades() else f"a finished {name}" for name in names]
    return " and ".join(written)
