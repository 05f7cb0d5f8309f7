"""Uses of the energy of bases: MULEs, larvae and creep, where an agent leaves the place open."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_bridge.auto.cast import caster, casters, note
from khala_bridge.auto.rule import NotAvailable, RuleOrder, not_available
from khala_bridge.auto.sites import best, near, promised_cells
from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground import land_of
from khala_bridge.state.ground.land import SEEN_NOW
from khala_bridge.state.side import finished, name, of_types, place

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.state import Unit

INJECTED: Final = 11
"""The game's number of the buff of an injected hatchery."""
HATCHERIES: Final = ("Hatchery", "Lair", "Hive")
TUMORS: Final = ("CreepTumor", "CreepTumorBurrowed", "CreepTumorQueen")
TUMOR_REACH: Final = 9.5
"""Distance at which a tumor plants the next one: half a cell less than the game allows, against rounding."""
QUEEN_REACH: Final = 30.0
"""Distance that a Queen walks to plant a tumor, in world units."""
OWN_FIELD: Final = 10.0
"""A mineral field within this distance of a town hall is its own."""


def mule(ask: RuleRequest) -> list[RuleOrder]:
    """Drop a MULE on the richest mineral field of the finished bases.

    Raises:
        NotAvailable: no Orbital Command can, or there are no minerals at the bases.
    """
    fields = fields_at_bases(ask)
    aimed = ask.ledger.aimed
    left = [field for field in fields if (ask.function.name, field.tag) not in aimed] or fields
    field = min(left, key=lambda unit: (-unit.mineral_contents, unit.tag))
    aimed.add((ask.function.name, field.tag))
    return [RuleOrder(ask.function, (caster(ask, place(field)).tag,), field.tag)]


def fields_at_bases(ask: RuleRequest) -> list[Unit]:
    """Return the mineral fields in sight at finished bases; at least one.

    Raises:
        NotAvailable: there is none.
    """
    land = land_of(ask.snapshot)
    halls = [place(hall) for hall in finished(land.own_halls)]
    fields = [
        field
        for field in land.standing("mineral_field")
        if field.tag in ask.snapshot.units and any(math.dist(place(field), hall) <= OWN_FIELD for hall in halls)
    ]
    if not fields:
        why = "there is no mineral field in sight at a finished base of yours."
        raise not_available(ask, why, "no mineral field at your bases")
    return fields


def inject(ask: RuleRequest) -> list[RuleOrder]:
    """Order Queens to inject every finished hatchery that needs it, each the nearest one.

    Raises:
        NotAvailable: no Queen can, or no hatchery needs it.
    """
    queens = casters(ask, None)
    needy = needy_hatcheries(ask)
    pairs = sorted((math.dist(place(q), place(h)), q.tag, h.tag) for q in queens for h in needy)
    orders: dict[int, RuleOrder] = {}
    injected: set[int] = set()
    for _, queen, hatchery in pairs:
        if queen not in orders and hatchery not in injected:
            orders[queen] = RuleOrder(ask.function, (queen,), hatchery)
            injected.add(hatchery)
            note(ask, ask.snapshot.units[queen])
            ask.ledger.aimed.add((ask.function.name, hatchery))
    return list(orders.values())


def needy_hatcheries(ask: RuleRequest) -> list[Unit]:
    """Return the finished hatcheries that nobody has injected; at least one.

    Raises:
        NotAvailable: there is none.
    """
    needy = [unit for unit in finished(of_types(ask.snapshot, HATCHERIES)) if INJECTED not in unit.buff_ids]
    needy = [unit for unit in needy if (ask.function.name, unit.tag) not in ask.ledger.aimed]
    if not needy:
        why = "every finished Hatchery has it already; try again in half a minute."
        raise not_available(ask, why, "every finished Hatchery has it already")
    return needy


def creep_tumor(ask: RuleRequest) -> list[RuleOrder]:
    """Plant a tumor with every tumor that can, or else with one Queen, where it spreads the creep most.

    Raises:
        NotAvailable: no unit can, or there is no room on creep in sight.
    """
    orders = []
    for unit, reach in _planters(ask):
        spot = _edge(ask, unit, reach)
        if spot is not None:
            ask.ledger.promise(spot, 1, 1)
            note(ask, unit)
            orders.append(RuleOrder(ask.function, (unit.tag,), spot))
    if not orders:
        raise _no_creep(ask)
    return orders


def free_creep(ask: RuleRequest) -> None:
    """Raise the error of `creep_tumor` if there is nothing to plant on.

    Raises:
        NotAvailable: no unit can, or there is no room on creep in sight.
    """
    if not any(_edge(ask, unit, reach) for unit, reach in _planters(ask)):
        raise _no_creep(ask)


def _planters(ask: RuleRequest) -> list[tuple[Unit, float]]:
    """Return the tumors that can spread, or else one Queen, and how far each reaches."""
    able = casters(ask, None)
    tumors = [unit for unit in able if name(unit) in TUMORS]
    return [(unit, TUMOR_REACH) for unit in tumors] or [(unit, QUEEN_REACH) for unit in able[:1]]


def _no_creep(ask: RuleRequest) -> NotAvailable:
    return not_available(ask, "there is no free creep in sight within reach.", "no free creep within reach")


def _edge(ask: RuleRequest, unit: Unit, reach: float) -> WorldPoint | None:
    """Return the free place on creep, within reach of a unit, that is farthest from all tumors and hatcheries."""
    land = land_of(ask.snapshot)
    free = land.free & land.creep & (land.sight >= SEEN_NOW) & ~land.kept & ~promised_cells(land, ask.ledger)
    away = near(land, [place(unit)], reach=reach)
    sources = [place(u) for u in of_types(ask.snapshot, (*TUMORS, *HATCHERIES))]
    promised_spots = [WorldPoint((x0 + x1) / 2, (y0 + y1) / 2) for x0, y0, x1, y1 in ask.ledger.sites]
    cost = np.where(np.isfinite(away), -near(land, [*sources, *promised_spots]), np.inf).astype(np.float32)
    cell = best(free, cost)
    return None if cell is None else WorldPoint(cell[0] + 0.5, cell[1] + 0.5)
