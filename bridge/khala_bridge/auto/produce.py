"""Training, morphing and research: the choice of the producer if an action leaves it open.

An idle producer comes first, then the one with the shortest queue, since a model that orders five Zealots from two
Gateways means five; the lower tag wins a tie. A Reactor makes two places of one, a Larva is used once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.auto.rule import NotAvailable, RuleOrder, not_available
from khala_bridge.rules import AT_ONCE
from khala_bridge.state.ground import Land, footprint_of, land_of
from khala_bridge.state.ground.footprints import ADDON
from khala_bridge.state.side import is_structure

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.knowledge import AbilityFacts
    from khala_bridge.rules import UnitState


def train(ask: RuleRequest) -> list[RuleOrder]:
    """Order one unit, morph or add-on from the best producer.

    Raises:
        NotAvailable: there is no producer, or none can do it now.
    """
    best = min(producers(ask), key=lambda unit: _rank(ask, unit))
    facts = ask.facts(best.type)
    ask.charge(facts)
    _note(ask, best, facts)
    return [RuleOrder(ask.function, (best.tag,))]


def research(ask: RuleRequest) -> list[RuleOrder]:
    """Order an upgrade where it is researched; the next level, if it has levels.

    Raises:
        NotAvailable: it is known or under way already, or cannot be researched now.
    """
    best = min(ask.able(), key=lambda unit: _rank(ask, unit))
    level = ask.facts(best.type)
    ask.charge(level)
    if level is not None:
        ask.ledger.begun.add(level.id)
    ask.ledger.queued[best.tag] += 1
    return [RuleOrder(ask.function, (best.tag,))]


def morph_warpgates(ask: RuleRequest) -> list[RuleOrder]:
    """Turn every idle Gateway into a WarpGate.

    Raises:
        NotAvailable: there is none, or the upgrade is missing.
    """
    ready = tuple(unit.tag for unit in ask.able())
    ask.ledger.changing.update(ready)
    return [RuleOrder(ask.function, ready)]


# the producer ---------------------------------------------------------------------------------------------------------


def producers(ask: RuleRequest) -> list[UnitState]:
    """Return the producers that can do it now; for an add-on those with room, as the game may refuse for that alone.

    Raises:
        NotAvailable: there is none.
    """
    if ask.ability is None or ask.ability.does != "build_addon":
        return ask.able()
    land = land_of(ask.snapshot)
    try:
        able = ask.able()
    except NotAvailable as impossible:
        why = impossible.why
        if why is None or why.kind != "game" or _has_room(ask, land, ask.side.units[why.tag]):
            raise
        raise _no_room(ask, why.who) from None
    found = [unit for unit in able if _has_room(ask, land, unit)]
    if not found:
        raise _no_room(ask, able[0].type)
    return found


def _no_room(ask: RuleRequest, who: str) -> NotAvailable:
    why = f"something stands where the add-on of your {who} would be; lift it off and land it."
    return not_available(ask, why, f"no room beside {who}")


def _has_room(ask: RuleRequest, land: Land, unit: UnitState) -> bool:
    footprint = footprint_of(unit.type)
    place = ask.snapshot.units[unit.tag].pos
    if footprint is None:
        return True
    x, y = footprint.cell(place.x, place.y)
    return all(land.ground.holds(x + dx, y + dy) and bool(land.free[x + dx, y + dy]) for dx, dy in ADDON)


def _rank(ask: RuleRequest, unit: UnitState) -> tuple[int, int, int]:
    """Return a rank: the lower, the sooner this producer finishes a new order."""
    load = unit.orders + ask.ledger.queued[unit.tag]
    return load // (2 if unit.addon in ask.snapshot.facts.stand_ins("Reactor") else 1), load, unit.tag


def _note(ask: RuleRequest, unit: UnitState, facts: AbilityFacts | None) -> None:
    if not is_structure(ask.snapshot.units[unit.tag]):
        ask.ledger.take(unit.tag)
    elif facts is not None and facts.does in AT_ONCE:
        ask.ledger.changing.add(unit.tag)
    else:
        ask.ledger.queued[unit.tag] += 1
