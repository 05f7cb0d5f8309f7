"""Abilities that one of several units of the side can use: which unit uses them, and on what."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_bridge.auto.rule import NotAvailable, RuleOrder, not_available
from khala_bridge.state.ground import land_of
from khala_bridge.state.side import is_structure, name, place

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.frames import WorldPoint
    from khala_bridge.state import Unit


def cast(ask: RuleRequest) -> list[RuleOrder]:
    """Order one unit that can do it now to use an ability, at the target of the call.

    It is the nearest one if it has to go there, and the one with the most energy if the whole map is in reach.

    Raises:
        NotAvailable: no unit can.
    """
    target, where = _target(ask)
    unit = caster(ask, where)
    return [RuleOrder(ask.function, (unit.tag,), target)]


def recall_near(ask: RuleRequest) -> list[RuleOrder]:
    """Recall the units around the named one.

    Raises:
        NotAvailable: no unit can, or the named one is no unit that could be recalled itself.
    """
    named = None if ask.tag is None else ask.snapshot.units.get(ask.tag)
    if named is None or not named.is_own or is_structure(named):
        raise NotAvailable(
            "invalid_target", f"{hex(ask.tag or 0)} is no unit of yours; name the one around which all are recalled."
        )
    unit = caster(ask, place(named))
    return [RuleOrder(ask.function, (unit.tag,), place(named))]


def stop_building(ask: RuleRequest) -> list[RuleOrder]:
    """Cancel the newest training or research of the team's structures, or of the named one.

    Raises:
        NotAvailable: they do nothing.
    """
    tags = ask.units or (() if ask.tag is None else (ask.tag,))
    units = [ask.snapshot.units[tag] for tag in tags if tag in ask.snapshot.units]
    busy = tuple(unit.tag for unit in units if is_structure(unit) and unit.orders)
    if not busy:
        named = f"the {name(units[0])} {hex(units[0].tag)} trains and researches" if units else "the team does"
        raise not_available(ask, f"{named} nothing that could be called off.")
    return [RuleOrder(ask.function, busy)]


def cancel_building(ask: RuleRequest) -> list[RuleOrder]:
    """Cancel or halt the building of the named structure; the game decides which.

    Raises:
        NotAvailable: it is not a structure under construction, or the game does not allow it.
    """
    unit = None if ask.tag is None else ask.snapshot.units.get(ask.tag)
    if unit is None or not unit.is_own or not is_structure(unit):
        raise NotAvailable(
            "invalid_target", f"{hex(ask.tag or 0)} is no structure of yours; name one that is being built."
        )
    if unit.build_progress >= 1:
        raise not_available(
            ask, f"the {name(unit)} {hex(unit.tag)} is finished; only what is being built can be called off."
        )
    if not ask.has(unit.tag):
        raise not_available(ask, f"the game does not take it from the {name(unit)} {hex(unit.tag)} at this moment.")
    return [RuleOrder(ask.function, (unit.tag,))]


# units ----------------------------------------------------------------------------------------------------------------


def caster(ask: RuleRequest, where: WorldPoint | None) -> Unit:
    """Return the unit of the action's types that can use its ability now, noted in the ledger.

    Raises:
        NotAvailable: there is none; the text says what is missing.
    """
    unit = casters(ask, where)[0]
    note(ask, unit)
    return unit


def note(ask: RuleRequest, unit: Unit) -> None:
    """Note in the ledger that a unit uses the action's ability; a structure continues its other work."""
    facts = ask.facts(name(unit))
    ask.ledger.energy[unit.tag] += int(facts.energy) if facts is not None else 0
    if not is_structure(unit):
        ask.ledger.take(unit.tag)


def casters(ask: RuleRequest, where: WorldPoint | None) -> list[Unit]:
    """Return every unit that can use the action's ability now, the best one first; at least one."""
    able = ask.able()
    facts = ask.facts(able[0].type)
    goes = facts is not None and facts.range is not None

    def rank(unit: Unit) -> tuple[float, float, int]:
        away = 0.0 if where is None else math.dist(place(unit), where)
        energy = -float(int(unit.energy - ask.ledger.energy[unit.tag]))
        return (away, energy, unit.tag) if goes else (energy, away, unit.tag)

    return sorted((ask.snapshot.units[unit.tag] for unit in able), key=rank)


# targets --------------------------------------------------------------------------------------------------------------


def _target(ask: RuleRequest) -> tuple[int | WorldPoint | None, WorldPoint | None]:
    """Return the target of the call, as the function takes it, and its place."""
    if ask.tag is None:
        return ask.point, ask.point
    unit = land_of(ask.snapshot).unit(ask.tag)
    if unit is None:
        raise NotAvailable("unknown_target", f"No unit {hex(ask.tag)} is known; use a tag that stands in your lists.")
    return (place(unit) if ask.action.aim == "place" else unit.tag), place(unit)
