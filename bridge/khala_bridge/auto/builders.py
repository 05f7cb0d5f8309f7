"""Which worker builds: of those with the least important work, the nearest to the place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_bridge.state.ground import land_of
from khala_bridge.state.ground.land import built_by
from khala_bridge.state.side import ability, bears_resources, is_doing, name, place

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.frames import WorldPoint
    from khala_bridge.state import Snapshot, Unit


def builder(ask: RuleRequest, where: WorldPoint) -> tuple[Unit, bool]:
    """Return the worker that builds at a place, and whether the order waits behind those that it has.

    In a team: the nearest one, and a second structure waits for the first. In the whole side: the nearest one among
    those that are idle or gather minerals and carry nothing; then those that carry something, then those that gather
    gas. Workers that build, scout or were ordered by an agent in this turn are left alone.

    Raises:
        NotAvailable: there is none.
    """
    able = [ask.snapshot.units[unit.tag] for unit in ask.able()]
    return _of_team(ask, able, where) if ask.units else (_of_side(ask, able, where), False)


def _of_team(ask: RuleRequest, able: list[Unit], where: WorldPoint) -> tuple[Unit, bool]:
    def rank(unit: Unit) -> tuple[bool, float, int]:
        return _has_more_to_do(ask, unit), math.dist(place(unit), where), unit.tag

    best = min(able, key=rank)
    return best, _has_more_to_do(ask, best)


def _has_more_to_do(ask: RuleRequest, unit: Unit) -> bool:
    """Return True if a worker builds already, or was ordered to in this turn."""
    return unit.tag in ask.ledger.busy or any(built_by(order.ability_id) for order in unit.orders)


def _of_side(ask: RuleRequest, able: list[Unit], where: WorldPoint) -> Unit:
    return min(able, key=lambda unit: (use(ask.snapshot, unit), math.dist(place(unit), where), unit.tag))


_IDLE, _LADEN, _ON_GAS, _USED = range(4)


def use(snapshot: Snapshot, unit: Unit) -> int:
    """Return how important a worker's work is: 0 if idle or gathering minerals, 3 for anything but gathering."""
    if unit.orders and not is_doing(unit, ability("Harvest_Gather_screen"), ability("Harvest_Return_quick")):
        return _USED
    if is_on_gas(snapshot, unit):
        return _ON_GAS
    return _LADEN if bears_resources(unit) else _IDLE


def is_on_gas(snapshot: Snapshot, unit: Unit) -> bool:
    """Return True if a worker gathers gas."""
    target = land_of(snapshot).unit(unit.orders[0].target_unit_tag) if unit.orders else None
    return target is not None and name(target) in GAS_STRUCTURES


GAS_STRUCTURES = frozenset(
    f"{structure}{rich}" for structure in ("Assimilator", "Refinery", "Extractor") for rich in ("", "Rich")
)
