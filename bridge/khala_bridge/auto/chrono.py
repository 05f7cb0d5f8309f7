"""Chrono Boost for a purpose that an agent names: the economy, the army or research."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Final

from khala_bridge.auto.cast import caster
from khala_bridge.auto.rule import NotAvailable, RuleOrder, not_available
from khala_bridge.rules import price_of
from khala_bridge.state.ground import land_of
from khala_bridge.state.side import ability, finished, is_structure, name, place

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.knowledge import AbilityFacts, MapFacts
    from khala_bridge.state import Unit

BOOSTED: Final = 281
"""The game's number of the buff of Chrono Boost."""
MAKING: Final = frozenset({"train", "research", "warp_in"})
"""Kinds of abilities that Chrono Boost speeds up."""
WARP: Final = "TrainWarp_Zealot_screen"
"""The ability that a WarpGate always has unless it recharges."""


def chrono_economy(ask: RuleRequest) -> list[RuleOrder]:
    """Boost a structure that trains workers.

    Raises:
        NotAvailable: no structure does, or no Nexus can.
    """
    return _boost(ask, training_workers(ask))


def chrono_military(ask: RuleRequest) -> list[RuleOrder]:
    """Boost a structure that trains something other than workers, or else a WarpGate that recharges.

    Raises:
        NotAvailable: no structure does, or no Nexus can.
    """
    return _boost(ask, training_army(ask))


def chrono_research(ask: RuleRequest) -> list[RuleOrder]:
    """Boost a structure that researches.

    Raises:
        NotAvailable: no structure does, or no Nexus can.
    """
    return _boost(ask, researching(ask))


def chrono_unit(ask: RuleRequest) -> list[RuleOrder]:
    """Boost the named structure.

    Raises:
        NotAvailable: it is no finished structure that makes anything, or no Nexus can.
    """
    unit = None if ask.tag is None else ask.snapshot.units.get(ask.tag)
    if unit is None or unit.build_progress < 1 or not makes_something(ask.snapshot.facts, name(unit)):
        what = hex(ask.tag or 0) if unit is None else f"{name(unit)} {hex(unit.tag)}"
        raise NotAvailable(
            "invalid_target", f"The {what} is no finished structure that trains, researches or warps in; name one."
        )
    return _boost(ask, [unit])


def training_workers(ask: RuleRequest) -> list[Unit]:
    """Return the structures that train workers and are not boosted yet, at least one.

    Raises:
        NotAvailable: there is none.
    """
    found = [unit for unit, facts in _at_work(ask) if _is_worker(ask, facts)]
    return _without_boost(ask, found, "no Nexus trains Probes that is not boosted yet; train Probes first.")


def training_army(ask: RuleRequest) -> list[Unit]:
    """Return the structures that train something else, then the WarpGates that recharge, at least one.

    Raises:
        NotAvailable: there is none that is not boosted yet.
    """
    training = [unit for unit, facts in _at_work(ask) if facts.does == "train" and not _is_worker(ask, facts)]
    why = "no structure trains an army unit that is not boosted yet; train one first."
    return _without_boost(ask, [*training, *_recharging(ask)], why)


def researching(ask: RuleRequest) -> list[Unit]:
    """Return the structures that research and are not boosted yet, at least one.

    Raises:
        NotAvailable: there is none.
    """
    found = [unit for unit, facts in _at_work(ask) if facts.researches is not None]
    return _without_boost(
        ask, found, "no structure researches anything that is not boosted yet; research something first."
    )


def working(ask: RuleRequest) -> list[Unit]:
    """Return every structure that works or recharges and is not boosted yet; it may be none."""
    found = [unit for unit, facts in _at_work(ask) if facts.does == "train" or facts.researches is not None]
    return [unit for unit in (*found, *_recharging(ask)) if BOOSTED not in unit.buff_ids]


def boostable(ask: RuleRequest) -> list[Unit]:
    """Return the finished structures that the game takes as targets; it may be none."""
    return [unit for unit in finished(ask.snapshot.own) if makes_something(ask.snapshot.facts, name(unit))]


@functools.cache
def makes_something(facts: MapFacts, unit_type: str) -> bool:
    """Return True if units of a type are structures that train, research or warp in."""
    known = facts.units.get(unit_type)
    if known is None or not known.structure:
        return False
    can = (facts.abilities[number] for number in known.ability_ids if number in facts.abilities)
    return any(ability.does in MAKING or ability.researches is not None for ability in can)


def _at_work(ask: RuleRequest) -> list[tuple[Unit, AbilityFacts]]:
    """Return the finished own structures with their work, those with the most work left first."""
    answers = land_of(ask.snapshot).answers
    if _at_work not in answers:
        answers[_at_work] = _find_at_work(ask)
    found: list[tuple[Unit, AbilityFacts]] = answers[_at_work]
    return found


def _find_at_work(ask: RuleRequest) -> list[tuple[Unit, AbilityFacts]]:
    busy = [unit for unit in finished(ask.snapshot.own) if unit.orders and is_structure(unit)]
    found = [(unit, ask.snapshot.facts.abilities.get(unit.orders[0].ability_id)) for unit in busy]
    known = [(unit, facts) for unit, facts in found if facts is not None]
    return sorted(known, key=lambda work: (work[0].orders[0].progress, work[0].tag))


def _is_worker(ask: RuleRequest, facts: AbilityFacts) -> bool:
    made = ask.snapshot.facts.units.get(facts.produces or "")
    return made is not None and made.worker


def _recharging(ask: RuleRequest) -> list[Unit]:
    """Return the WarpGates that cannot warp in a Zealot now, though the player could pay for one."""
    known = ask.snapshot.abilities
    zealot = ask.snapshot.facts.abilities[ability(WARP)]
    if known is None or ask.ledger.short_of(price_of(zealot)):
        return []
    gates = [unit for unit in finished(ask.snapshot.own) if name(unit) == "WarpGate" and unit.is_powered]
    return [gate for gate in gates if not ask.can(gate.tag, zealot.id)]


def _without_boost(ask: RuleRequest, units: Sequence[Unit], nothing: str) -> list[Unit]:
    """Return those of some structures that are not boosted, nor going to be by an earlier call of this turn."""
    aimed = ask.ledger.aimed
    left = [u for u in units if BOOSTED not in u.buff_ids and (ask.function.name, u.tag) not in aimed]
    if not left:
        raise not_available(ask, nothing, "nothing to boost")
    return left


def _boost(ask: RuleRequest, targets: Sequence[Unit]) -> list[RuleOrder]:
    """Boost the first of some structures."""
    unit = caster(ask, place(targets[0]))
    ask.ledger.aimed.add((ask.function.name, targets[0].tag))
    return [RuleOrder(ask.function, (unit.tag,), targets[0].tag)]
