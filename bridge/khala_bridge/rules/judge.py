"""Why an action is not possible now: the reasons, their order, and when each of them counts.

The judge is the game, which says once an observation what each unit can do. This module works out why it says no, from
the state and the facts of the ability:

| the game              | reasons for a team                  | more of them if the host chooses the unit         |
|-----------------------|-------------------------------------|---------------------------------------------------|
| says yes              | weapon, research, energy, price     | unfinished, add-on, orders, queue, power          |
| says no               | everything; at last "the game"      |                                                   |
| was not asked         | a weapon or an upgrade is missing   | everything but the cooldown and "the game"        |

Even after a yes, price, energy and research are judged, since earlier calls of the turn spend resources and begin
research. A unit whose weapon is off may attack, by the game's answer, and yet the game refuses each target. The host
picks one of many units, and looks at the orders of each. Range is not a reason: units walk.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from khala_bridge.rules.cost import facts_for, is_free, price_of
from khala_bridge.rules.unavailable import Unavailable, rank
from khala_bridge.rules.weapons import can_shoot, is_attack

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from khala_bridge.catalogue.action import Action
    from khala_bridge.catalogue.functions import Function
    from khala_bridge.knowledge import AbilityFacts, MapFacts
    from khala_bridge.rules.ledger import Ledger
    from khala_bridge.rules.values import SideState, UnitState

QUEUE, REACTOR_QUEUE = 5, 8
"""Orders that a structure holds, with the one at work; with a Reactor more."""
QUEUED = frozenset({"train", "research"})
"""Kinds of abilities that a structure puts into its queue."""
AT_ONCE = frozenset({"build_addon", "grow", "morph", "structure_morph"})
"""Kinds of abilities that a structure does at once or not at all."""


class Use(NamedTuple):
    """The question to the judge. `use_of` and `asked_by` make it."""

    ability: int
    switch: bool
    """Whether it sets an autocast, which the game's query leaves out."""
    attack: bool
    by_host: bool
    """Whether the host chooses the unit, so that it looks at the orders of each."""
    at_unit: bool
    """Whether it is aimed at a unit: a unit without a weapon may attack a place, and just goes there."""
    of_side: bool
    """Whether any unit of the side may do it; then only workers that gather are taken."""


@functools.lru_cache(4096)
def use_of(function: Function, *, by_host: bool = False, at_unit: bool = False, of_side: bool = False) -> Use:
    """Return the question of a function of PySC2."""
    return Use(function.ability_id, function.kind == "autocast", is_attack(function), by_host, at_unit, of_side)


def asked_by(action: Action, *, of_side: bool) -> Use | None:
    """Return the question of an action; None for one that orders nothing."""
    function = action.pysc2
    by_host = action.rule is not None
    if function is None:
        return None
    return use_of(function, by_host=by_host, at_unit=action.target_kind == "tag", of_side=of_side)


class _Case(NamedTuple):
    """One unit and one ability: the input of the reasons."""

    use: Use
    facts: AbilityFacts
    unit: UnitState
    side: SideState
    ledger: Ledger


Reason: TypeAlias = "Callable[[_Case], Unavailable | None]"


def why_not(use: Use, unit: UnitState, side: SideState, ledger: Ledger) -> Unavailable | None:
    """Return why a unit cannot do something now; None if it can."""
    able = unit.able
    says_yes = None if able is None or use.switch else use.ability in able
    if use.attack and _needs_weapon(use, unit, side.facts, says_yes=says_yes):
        return Unavailable("weapon", unit.type, unit.tag)
    if use.attack and use.at_unit and unit.disarmed:
        return Unavailable("disarmed", unit.type, unit.tag)
    if says_yes and not use.by_host and is_free(side.facts, use.ability, unit.type):
        return None
    facts = facts_for(side.facts, use.ability, unit.type, side.upgrades)
    if facts is None and use.by_host and says_yes:
        facts = side.facts.abilities.get(use.ability)
    if facts is None:
        return Unavailable("ability", unit.type, unit.tag) if says_yes is False or use.by_host else None
    case = _Case(use, facts, unit, side, ledger)
    found = (reason(case) for reason in _reasons(says_yes, by_host=use.by_host))
    return next((why for why in found if why is not None), None)


def why_no_one(use: Use, units: Sequence[UnitState], side: SideState, ledger: Ledger) -> Unavailable | None:
    """Return why none of some units can do something now, by the unit that is nearest to it; None if one can.

    There must be at least one unit.
    """
    found: list[Unavailable] = []
    for unit in units:
        why = why_not(use, unit, side, ledger)
        if why is None:
            return None
        found.append(why)
    return nearest(found)._replace(among=tuple(dict.fromkeys([unit.type for unit in units])))


def nobody(types: Sequence[str]) -> Unavailable:
    """Return the reason if there is no unit of some types."""
    return Unavailable("nobody", " or ".join(types[:3]))


def nearest(reasons: Sequence[Unavailable]) -> Unavailable:
    """Return the reason that is easiest to overcome."""
    return reasons[0] if len(reasons) == 1 else max(reasons, key=rank)


def sure(facts: MapFacts, function: Function | None, unit_type: str, researched: Collection[str]) -> Unavailable | None:
    """Return why units of a type cannot do something in any state; None if the game must be asked."""
    if function is None:
        return None
    if is_attack(function) and not facts.is_armed(unit_type):
        return Unavailable("weapon", unit_type)
    ability = facts.ability_of(function.ability_id, unit_type)
    needed = sorted(ability.requires) if ability else ()
    missing = tuple(need for need in needed if _lacks(facts, need, researched))
    return Unavailable("requirement", unit_type, names=missing) if missing else None


@functools.cache
def _reasons(says_yes: bool | None, *, by_host: bool) -> tuple[Reason, ...]:  # a key of the cache
    """Return the reasons that count, in their order."""
    last: tuple[Reason, ...] = (_cooldown, _otherwise)
    if by_host:
        tech = () if says_yes else (_requirement,)
        own = (_taken, _occupied, _queue, _attached, _work, _power)
        return (_unfinished, _research, *tech, _addon, _energy, _price, *own, *(last if says_yes is False else ()))
    if says_yes:
        return _research, _energy, _price
    if says_yes is None:
        return (_upgrade,)
    return _unfinished, _research, _requirement, _addon, _energy, _price, _queue, _power, *last


def _needs_weapon(use: Use, unit: UnitState, facts: MapFacts, *, says_yes: bool | None) -> bool:
    if says_yes:
        return use.at_unit and not can_shoot(facts, unit.type, unit.able or frozenset())
    return not facts.is_armed(unit.type)


def _lacks(facts: MapFacts, need: str, researched: Collection[str]) -> bool:
    return need in facts.upgrades and need not in researched


# --- the reasons --------------------------------------------------------------------------------------------------


def _unfinished(case: _Case) -> Unavailable | None:
    """Return a reason if it is unfinished."""
    unit = case.unit
    return None if unit.is_finished else Unavailable("unfinished", unit.type, unit.tag, has=unit.progress)


def _research(case: _Case) -> Unavailable | None:
    """Return a reason if it is researched, or under research."""
    facts, unit = case.facts, case.unit
    if not facts.researches:
        return None
    if facts.researches in case.side.upgrades:
        return Unavailable("researched", unit.type, unit.tag, names=(facts.researches,))
    if facts.id in case.side.ordered or facts.id in case.ledger.begun:
        return Unavailable("researching", unit.type, unit.tag, names=(facts.researches,))
    return None


def _requirement(case: _Case) -> Unavailable | None:
    """Return a reason if a structure or an upgrade is missing."""
    types = case.side.facts.units
    missing = [need for need in case.facts.requires if not case.side.has(need)]
    missing.sort(key=lambda need: need not in types)  # structures before the upgrades that they research
    if not missing:
        return None
    begun = tuple(need for need in missing if need in types and case.side.builds(need))
    return Unavailable("requirement", case.unit.type, case.unit.tag, names=tuple(missing), begun=begun)


def _upgrade(case: _Case) -> Unavailable | None:
    """Return a reason if an upgrade is missing; missing structures are uncertain if the game was not asked."""
    missing = tuple(need for need in case.facts.requires if _lacks(case.side.facts, need, case.side.upgrades))
    return Unavailable("requirement", case.unit.type, case.unit.tag, names=missing) if missing else None


def _addon(case: _Case) -> Unavailable | None:
    """Return a reason if an add-on is missing."""
    addon, unit = case.facts.addon, case.unit
    if not addon or unit.addon in case.side.facts.stand_ins(addon):
        return None
    return Unavailable("addon", unit.type, unit.tag, names=(addon,))


def _energy(case: _Case) -> Unavailable | None:
    """Return a reason if it has too little energy after earlier calls of the turn."""
    unit, needs = case.unit, case.facts.energy
    left = unit.energy - case.ledger.energy[unit.tag] if needs else 0.0
    return None if needs <= left else Unavailable("energy", unit.type, unit.tag, needs=needs, has=left)


def _price(case: _Case) -> Unavailable | None:
    """Return a reason if minerals, vespene or supply do not suffice after earlier calls of the turn."""
    missing = case.ledger.short_of(price_of(case.facts))
    return Unavailable("price", case.unit.type, case.unit.tag, missing=missing) if missing else None


def _taken(case: _Case) -> Unavailable | None:
    """Return a reason if an earlier call of the turn uses it; structures can do several things."""
    unit, does = case.unit, case.facts.does
    goes_on = does == "build" or (does != "warp_in" and case.side.facts.is_structure(unit.type))
    if goes_on or unit.tag not in case.ledger.busy:
        return None
    return Unavailable("taken", unit.type, unit.tag)


def _occupied(case: _Case) -> Unavailable | None:
    """Return a reason if it is a worker with other work than gathering; a team's worker queues its buildings."""
    unit = case.unit
    if case.facts.does != "build" or not case.use.of_side or (unit.gathers and unit.tag not in case.ledger.busy):
        return None
    return Unavailable("occupied", unit.type, unit.tag)


def _queue(case: _Case) -> Unavailable | None:
    """Return a reason if its production queue is full."""
    unit, ledger = case.unit, case.ledger
    if case.facts.does not in QUEUED or not case.side.facts.is_structure(unit.type):
        return None
    places = REACTOR_QUEUE if unit.addon in case.side.facts.stand_ins("Reactor") else QUEUE
    full = unit.orders + ledger.queued[unit.tag] >= places or unit.tag in ledger.changing
    return Unavailable("queue", unit.type, unit.tag) if full else None


def _attached(case: _Case) -> Unavailable | None:
    """Return a reason if it has an add-on already, finished or not."""
    has_one = case.facts.does == "build_addon" and case.unit.attached
    return Unavailable("attached", case.unit.type, case.unit.tag) if has_one else None


def _work(case: _Case) -> Unavailable | None:
    """Return a reason if it has orders, and this one must be done at once."""
    unit, ledger = case.unit, case.ledger
    if case.facts.does not in AT_ONCE or not case.side.facts.is_structure(unit.type):
        return None
    idle = not unit.orders and not ledger.queued[unit.tag] and unit.tag not in ledger.changing
    return None if idle else Unavailable("at_work", unit.type, unit.tag)


def _power(case: _Case) -> Unavailable | None:
    """Return a reason if no Pylon powers it."""
    return None if case.unit.powered else Unavailable("power", case.unit.type, case.unit.tag)


def _cooldown(case: _Case) -> Unavailable | None:
    """Return the cooldown as the reason, if there is one; the game does not show it, but nothing else is left."""
    pause = case.facts.cooldown_s
    return Unavailable("cooldown", case.unit.type, case.unit.tag, needs=pause) if pause else None


def _otherwise(case: _Case) -> Unavailable:
    """Return the game itself as the reason: nothing known speaks against it."""
    return Unavailable("game", case.unit.type, case.unit.tag, has=case.unit.orders)
