"""Who trains, morphs and researches: the producer that an action leaves open.

An idle producer is preferred, then the one with the shortest queue, since a model that orders five Zealots from two
Gateways means five; ties go to the lower tag. A Reactor makes two places of one, a Larva is used once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.auto.price import charge, check, require
from khala_bridge.auto.rule import Order, never
from khala_bridge.knowledge import abilities, stand_ins
from khala_bridge.state.ground import Land, footprint_of, land_of
from khala_bridge.state.ground.footprints import ADDON
from khala_bridge.state.side import finished, has_upgrade, is_structure, kind, name, of_types, own_structures

if TYPE_CHECKING:
    from khala_bridge.auto.rule import Ask
    from khala_bridge.knowledge import AbilityFacts
    from khala_bridge.state import Unit

QUEUE, REACTOR_QUEUE = 5, 8
"""Orders that a structure holds, without and with a Reactor."""
_AT_ONCE = frozenset({"build_addon", "grow", "morph", "structure_morph"})
"""Kinds of abilities that a structure does at once or not at all, instead of putting them into its queue."""


def train(ask: Ask) -> list[Order]:
    """Orders one unit, morph or add-on from the best of the producers.

    Raises:
        Impossible: there is no producer, or none that can now.
    """
    producers = _producers(ask)
    types = [name(unit) for unit in producers]
    facts = ask.facts(types[0])
    if facts is not None:
        require(ask, facts)
    producers = _working(ask, producers)
    if facts is not None and facts.addon:
        producers = _with_addon(ask, producers, facts.addon)
    producers = _with_place(ask, producers, facts)
    if facts is not None:
        check(ask, facts, name(producers[0]))
    producers = _that_can(ask, producers)
    best = min(producers, key=lambda unit: _rank(ask, unit))
    if facts is not None:
        charge(ask, ask.facts(name(best)) or facts, name(best))
    _note(ask, best, facts)
    return [Order(ask.function, (best.tag,))]


def research(ask: Ask) -> list[Order]:
    """Orders an upgrade where it is researched; of one with levels the next.

    Raises:
        Impossible: it is known or under way already, or cannot be researched now.
    """
    level = _next_level(ask)
    producers = _producers(ask)
    require(ask, level)
    producers = _with_place(ask, _working(ask, producers), level)
    check(ask, level, name(producers[0]))
    best = min(_that_can(ask, producers), key=lambda unit: _rank(ask, unit))
    charge(ask, level, name(best))
    ask.ledger.begun.add(level.id)
    ask.ledger.queued[best.tag] += 1
    return [Order(ask.function, (best.tag,))]


def morph_warpgates(ask: Ask) -> list[Order]:
    """Turns every Gateway that works on nothing into a WarpGate.

    Raises:
        Impossible: there is none, or the upgrade is missing.
    """
    gateways = _producers(ask)
    facts = ask.facts("Gateway")
    if facts is not None:
        require(ask, facts)
    idle = [unit for unit in _working(ask, gateways) if _is_free(ask, unit)] or _all_at_work(ask, gateways)
    ready = _that_can(ask, idle)
    ask.ledger.changing.update(unit.tag for unit in ready)
    return [Order(ask.function, tuple(unit.tag for unit in ready))]


# who ------------------------------------------------------------------------------------------------------------------


def _producers(ask: Ask) -> list[Unit]:
    """The units that the words name, or those of the side that have the ability at all; never none."""
    if ask.units:
        found = [ask.snapshot.units[tag] for tag in ask.units if tag in ask.snapshot.units]
    else:
        found = of_types(ask.snapshot, _types(ask))
    if found:
        return found
    wanted = " or ".join(_types(ask)[:3])
    how = "wait for the next one" if wanted == "Larva" else "build one first"
    raise never(ask, f"you have no {wanted}; {how}.")


def _types(ask: Ask) -> tuple[str, ...]:
    facts = abilities().get(ask.function.ability_id)
    return ask.action.units or (facts.users if facts else ())


def _working(ask: Ask, units: list[Unit]) -> list[Unit]:
    """Those that are finished and have power."""
    there = finished(units)
    if not there:
        raise never(ask, f"your {name(units[0])} is not finished yet, it is at {units[0].build_progress:.0%}.")
    powered = [unit for unit in there if unit.is_powered or not _needs_power(unit)]
    if not powered:
        raise never(ask, f"your {name(there[0])} has no power; build a Pylon near it.")
    return powered


def _needs_power(unit: Unit) -> bool:
    known = kind(unit)
    return known is not None and known.needs_power


def _with_addon(ask: Ask, units: list[Unit], addon: str) -> list[Unit]:
    """Those that have an add-on of a kind."""
    wanted = stand_ins(addon)
    found = [unit for unit in units if _addon(ask, unit) in wanted]
    if not found:
        raise never(ask, f"no {name(units[0])} has a {addon}; Build_{addon}_{name(units[0])} makes one.")
    return found


def _addon(ask: Ask, unit: Unit) -> str | None:
    """Type of the finished add-on of a structure."""
    addon = ask.snapshot.units.get(unit.add_on_tag) if unit.add_on_tag else None
    return name(addon) if addon is not None and addon.build_progress >= 1 else None


def _with_place(ask: Ask, units: list[Unit], facts: AbilityFacts | None) -> list[Unit]:
    """Those that have room for one more order."""
    if facts is not None and facts.does == "build_addon":
        return _with_room(ask, [unit for unit in units if _is_free(ask, unit)] or _all_at_work(ask, units))
    if not is_structure(units[0]) or (facts is not None and facts.does in _AT_ONCE):
        return [unit for unit in units if _is_free(ask, unit)] or _all_at_work(ask, units)
    changing = ask.ledger.changing
    found = [unit for unit in units if _load(ask, unit) < _queue(ask, unit) and unit.tag not in changing]
    if not found:
        raise never(ask, f"the queue of every {name(units[0])} is full; wait until one is done or build another.")
    return found


def _is_free(ask: Ask, unit: Unit) -> bool:
    """Whether a unit is not taken in this turn, and, if it is a structure, has nothing to do."""
    if not is_structure(unit):
        return unit.tag not in ask.ledger.busy
    return not unit.orders and not ask.ledger.queued[unit.tag] and unit.tag not in ask.ledger.changing


def _all_at_work(ask: Ask, units: list[Unit]) -> list[Unit]:
    if is_structure(units[0]):
        raise never(ask, f"every {name(units[0])} is at work; it can be done when one has nothing in its queue.")
    raise never(ask, f"every {name(units[0])} has an order already in this turn.")


def _with_room(ask: Ask, units: list[Unit]) -> list[Unit]:
    """Those that have no add-on, and room for one."""
    bare = [unit for unit in units if not unit.add_on_tag]
    if not bare:
        raise never(ask, f"every idle {name(units[0])} has an add-on already; build another {name(units[0])}.")
    land = land_of(ask.snapshot)
    found = [unit for unit in bare if _has_room(land, unit)]
    if not found:
        raise never(
            ask, f"something stands where the add-on of your {name(bare[0])} would be; lift it off and land it."
        )
    return found


def _has_room(land: Land, unit: Unit) -> bool:
    footprint = footprint_of(name(unit))
    if footprint is None:
        return True
    x, y = footprint.cell(unit.pos.x, unit.pos.y)
    return all(land.ground.holds(x + dx, y + dy) and bool(land.free[x + dx, y + dy]) for dx, dy in ADDON)


def _that_can(ask: Ask, units: list[Unit]) -> list[Unit]:
    """Those from which the game would take the order."""
    found = [unit for unit in units if ask.has(unit.tag)]
    if not found:
        raise never(ask, f"the game does not take it from your {name(units[0])} at this moment; try again later.")
    return found


# how much -------------------------------------------------------------------------------------------------------------


def _rank(ask: Ask, unit: Unit) -> tuple[int, int, int]:
    """The less, the sooner a new order of this producer is done."""
    load = _load(ask, unit)
    return load // _slots(ask, unit), load, unit.tag


def _load(ask: Ask, unit: Unit) -> int:
    return len(unit.orders) + ask.ledger.queued[unit.tag]


def _slots(ask: Ask, unit: Unit) -> int:
    return 2 if _addon(ask, unit) in stand_ins("Reactor") else 1


def _queue(ask: Ask, unit: Unit) -> int:
    return REACTOR_QUEUE if _slots(ask, unit) > 1 else QUEUE


def _note(ask: Ask, unit: Unit, facts: AbilityFacts | None) -> None:
    if not is_structure(unit):
        ask.ledger.take(unit.tag)
    elif facts is not None and facts.does in _AT_ONCE:
        ask.ledger.changing.add(unit.tag)
    else:
        ask.ledger.queued[unit.tag] += 1


# what -----------------------------------------------------------------------------------------------------------------


def _next_level(ask: Ask) -> AbilityFacts:
    """The ability of the upgrade that would be researched now."""
    facts = abilities()[ask.function.ability_id]
    levels = [abilities()[number] for number in sorted(facts.special)] or [facts]
    left = [level for level in levels if not _is_known(ask, level)]
    if not left:
        raise never(ask, "it is researched already.")
    numbers = {level.id for level in levels}
    orders = (order.ability_id for unit in own_structures(ask.snapshot) for order in unit.orders)
    if numbers & ask.ledger.begun or not numbers.isdisjoint(orders):
        raise never(ask, "it is being researched already.")
    return left[0]


def _is_known(ask: Ask, level: AbilityFacts) -> bool:
    return level.researches is not None and has_upgrade(ask.snapshot, level.researches)
