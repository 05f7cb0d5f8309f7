"""Warping in: the gate that is ready, and the free places in power fields."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from khala_bridge.auto.rule import NotAvailable, RuleOrder, not_available
from khala_bridge.auto.sites import best, near, promised_cells
from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground import land_of
from khala_bridge.state.ground.resources import coordinates, everywhere
from khala_bridge.state.means import ledger_of
from khala_bridge.state.side import finished, is_structure, kind, name, of_types, place

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.rules import Ledger
    from khala_bridge.state import PowerSource, Snapshot, Unit
    from khala_bridge.state.ground import Land
    from khala_bridge.state.ground.terrain import Bools

BODY: Final = 0.625
"""Radius of the widest unit that is warped in, a Stalker, in world units."""
CROWD: Final = 7.0
"""Units within this distance make a power field crowded."""
BESIDE: Final = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
"""A cell and its four neighbours."""
FAST: Final = {"Nexus": 7.0, "Gateway": 6.5, "WarpGate": 6.5}
"""Distance to one of these structures within which a Pylon warps in fast, in world units."""


class PowerField(NamedTuple):
    """A power field, as far as it matters to a model that wants to warp in there."""

    tag: int
    """Of the Pylon or phasing WarpPrism."""
    fast: bool
    """Whether units warp in fast there."""
    room: bool
    """Whether there is room for one more unit."""


def fields(snapshot: Snapshot) -> tuple[PowerField, ...]:
    """Return the player's power fields, by ascending tags."""
    land = land_of(snapshot)
    if fields not in land.answers:
        ledger = ledger_of(snapshot)
        land.answers[fields] = tuple(
            PowerField(source.tag, _is_fast(snapshot, source), bool(_free(snapshot, ledger, source).any()))
            for source in land.power_sources
        )
    found: tuple[PowerField, ...] = land.answers[fields]
    return found


def any_field(ask: RuleRequest) -> None:
    """Raise the error of `warp_auto` if no field has room at the beginning of a turn.

    Raises:
        NotAvailable: no field has room.
    """
    if not any(field.room for field in fields(ask.snapshot)):
        raise _no_field(ask)


def warp_near(ask: RuleRequest) -> list[RuleOrder]:
    """Warp a unit in as near to a Pylon or phasing WarpPrism as there is room.

    Raises:
        NotAvailable: no gate is ready, the resources do not suffice, or there is no room in that field.
    """
    land = land_of(ask.snapshot)
    source = next((s for s in land.power_sources if s.tag == ask.tag), None)
    if source is None:
        unit = None if ask.tag is None else land.unit(ask.tag)
        what = "unit" if unit is None else name(unit)
        raise NotAvailable(
            "invalid_target",
            f"The {what} {hex(ask.tag or 0)} has no power field; name a finished Pylon or phasing WarpPrism of yours.",
        )
    gate = _gate(ask)
    cell = _room(ask.snapshot, ask.ledger, source)
    if cell is None:
        raise NotAvailable(
            "invalid_target",
            f"There is no room in the power field of {hex(source.tag)}; name another Pylon, or move the units away.",
        )
    return _warp(ask, gate, cell)


def warp_auto(ask: RuleRequest) -> list[RuleOrder]:
    """Warp a unit in at the fastest field, and among equal ones where the fewest own units stand.

    Raises:
        NotAvailable: no gate is ready, the resources do not suffice, or no field has room.
    """
    gate = _gate(ask)
    for source in sorted(land_of(ask.snapshot).power_sources, key=lambda source: _rank(ask, source)):
        cell = _room(ask.snapshot, ask.ledger, source)
        if cell is not None:
            return _warp(ask, gate, cell)
    raise _no_field(ask)


def _no_field(ask: RuleRequest) -> NotAvailable:
    return not_available(ask, "no power field has room for it; build a Pylon first.", "no power field with room")


def _warp(ask: RuleRequest, gate: Unit, cell: tuple[int, int]) -> list[RuleOrder]:
    ask.charge(ask.facts(name(gate)))
    ask.ledger.take(gate.tag)
    point = WorldPoint(cell[0] + 0.5, cell[1] + 0.5)
    ask.ledger.promise(point, 1, 1)
    return [RuleOrder(ask.function, (gate.tag,), point)]


def _gate(ask: RuleRequest) -> Unit:
    """Return the gate that is ready; among several the one with the least tag."""
    return ask.snapshot.units[ask.able()[0].tag]


# places ---------------------------------------------------------------------------------------------------------------


def _rank(ask: RuleRequest, source: PowerSource) -> tuple[bool, int, int]:
    """Return a rank: the lower, the better a field is for the next unit."""
    middle = (source.pos.x, source.pos.y)
    units = [u for u in ask.snapshot.own if not is_structure(u) and math.dist(place(u), middle) <= CROWD]
    return not _is_fast(ask.snapshot, source), len(units) + len(ask.ledger.sites), source.tag


def _is_fast(snapshot: Snapshot, source: PowerSource) -> bool:
    unit = snapshot.units.get(source.tag)
    if unit is not None and name(unit) == "WarpPrismPhasing":
        return True
    middle = (source.pos.x, source.pos.y)
    near_by = finished(of_types(snapshot, FAST))
    return any(math.dist(place(other), middle) <= FAST[name(other)] for other in near_by)


def _room(snapshot: Snapshot, ledger: Ledger, source: PowerSource) -> tuple[int, int] | None:
    """Return the nearest cell to a source where a unit touches no other; cells with free neighbours come first."""
    land = land_of(snapshot)
    free = _free(snapshot, ledger, source)
    away = near(land, [WorldPoint(source.pos.x, source.pos.y)])
    airy = free & everywhere(land.open & ~promised_cells(land, ledger), BESIDE)
    return best(airy & ~land.kept, away) or best(airy, away) or best(free, away)


def _free(snapshot: Snapshot, ledger: Ledger, source: PowerSource) -> Bools:
    """Return the cells (w, h) of a field where a unit touches no other."""
    land = land_of(snapshot)
    field = land.power_cells(corner=False, by=source.tag) & land.open
    return field & ~promised_cells(land, ledger) & ~_bodies(snapshot, land, source)


def _bodies(snapshot: Snapshot, land: Land, source: PowerSource) -> Bools:
    """Return the cells (w, h) around a power source in whose middle a unit would touch another one."""
    result = np.zeros(land.ground.size, np.bool_)
    reach = source.radius + 2
    for unit in snapshot.units.values():
        offset = max(abs(unit.pos.x - source.pos.x), abs(unit.pos.y - source.pos.y))
        if offset > reach or unit.is_flying or is_structure(unit) or _is_neutral_ground(unit):
            continue
        apart = BODY + unit.radius
        x0, y0 = max(int(unit.pos.x - apart - 1), 0), max(int(unit.pos.y - apart - 1), 0)
        part = result[x0 : int(unit.pos.x + apart + 2), y0 : int(unit.pos.y + apart + 2)]
        x, y = coordinates((part.shape[0], part.shape[1]), (x0, y0))
        part |= (x + 0.5 - unit.pos.x) ** 2 + (y + 0.5 - unit.pos.y) ** 2 < apart**2
    return result


def _is_neutral_ground(unit: Unit) -> bool:
    """Return True if a unit is a resource or an obstacle, whose footprint the land knows."""
    known = kind(unit)
    return known is not None and known.race == "neutral" and not known.speed
