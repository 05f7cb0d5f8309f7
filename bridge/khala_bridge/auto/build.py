"""Building: at a point, near a unit, or where the host finds it best."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from khala_bridge.auto.builders import GAS_STRUCTURES, builder
from khala_bridge.auto.places import for_structure, free_base, free_geyser, has_room
from khala_bridge.auto.rule import NotAvailable, RuleOrder, not_available
from khala_bridge.auto.sites import best, footprint_need, good, legal, near, on_corner, promised_cells
from khala_bridge.catalogue.functions import functions
from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground import land_of, sites
from khala_bridge.state.ground.land import SEEN_NOW, addon_place
from khala_bridge.state.side import name, place

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.state import Unit
    from khala_bridge.state.ground import Base, Land

NEAR = 10.0
"""World units within which a structure stands that is built near a unit."""
ON_GEYSER = 2.0
"""A point within this distance of the middle of a geyser means the geyser."""
OF_BASE = 12.0
"""A unit within this distance of a place for a town hall means this place."""


def build_at(ask: RuleRequest) -> list[RuleOrder]:
    """Build at a point, on the nearest cells of the grid.

    Raises:
        NotAvailable: there is no builder, it is too dear or has to wait for others, or it cannot stand there.
    """
    assert ask.point is not None, f"{ask.action.name} is said with a point"
    ask.able()
    if is_gas(ask):
        near_by = [u for u in free_geysers(ask) if math.dist(place(u), ask.point) <= ON_GEYSER]
        if not near_by:
            raise NotAvailable("invalid_target", f"There is no free geyser there; {structure_of(ask)} stands on one.")
        return _on_geyser(ask, near_by[0])
    footprint = footprint_need(structure_of(ask))
    return _check_and_build(ask, footprint.middle(footprint.cell(*ask.point)))


def build_near(ask: RuleRequest) -> list[RuleOrder]:
    """Build near a unit: a town hall on the base place of its resources, gas on the geyser, others as near as possible.

    Raises:
        NotAvailable: as `build_at`, or there is no place near it.
    """
    unit = _landmark(ask)
    ask.able()
    land = land_of(ask.snapshot)
    structure = structure_of(ask)
    if is_gas(ask):
        free = free_geysers(ask)
        found = min(free, key=lambda u: (math.dist(place(u), place(unit)), u.tag), default=None)
        if found is None or math.dist(place(found), place(unit)) > NEAR:
            raise NotAvailable("invalid_target", f"There is no free geyser near the {name(unit)} {hex(unit.tag)}.")
        return _on_geyser(ask, found)
    if sites()[structure].clear:
        return _check_and_build(ask, _base_of(ask, unit).place)
    cost = near(land, [place(unit)], reach=NEAR, corner=on_corner(structure))
    cell = best(good(land, ask.ledger, structure), cost) or best(legal(land, ask.ledger, structure), cost)
    if cell is None:
        what = f"{name(unit)} {hex(unit.tag)}{_lack(structure)}"
        raise NotAvailable("invalid_target", f"There is no room for a {structure} within {NEAR:g} of the {what}.")
    return _build(ask, footprint_need(structure).middle(cell))


def lock_base(ask: RuleRequest) -> list[RuleOrder]:
    """Build on the very place where a town hall would gather a resource best, so that no other player can take it.

    Raises:
        NotAvailable: as `build_at`.
    """
    unit = _landmark(ask)
    ask.able()
    footprint = footprint_need(structure_of(ask))
    return _check_and_build(ask, footprint.middle(footprint.cell(*_base_of(ask, unit).place)))


def build_auto(ask: RuleRequest) -> list[RuleOrder]:
    """Build where the host finds it best, with a worker of the side that goes back to the minerals afterwards.

    Raises:
        NotAvailable: there is no place, or as `build_at`.
    """
    ask.able()
    land = land_of(ask.snapshot)
    structure = structure_of(ask)
    if is_gas(ask):
        orders = _on_geyser(ask, free_geyser(ask, free_geysers(ask)))
    elif sites()[structure].clear:
        orders = _build(ask, free_base(ask, land, structure))
    else:
        cell = for_structure(land, ask.ledger, structure)
        if cell is None:
            raise _no_room(ask)
        orders = _build(ask, footprint_need(structure).middle(cell))
    return [*orders, *_back_to_work(ask, orders[-1])]


def any_place(ask: RuleRequest) -> None:
    """Raise the error of `build_auto` if there is no place at the beginning of a turn.

    Raises:
        NotAvailable: there is no place.
    """
    land = land_of(ask.snapshot)
    structure = structure_of(ask)
    if is_gas(ask):
        free_geyser(ask, free_geysers(ask))
    elif sites()[structure].clear:
        free_base(ask, land, structure)
    elif not has_room(land, structure):
        raise _no_room(ask)


def _no_room(ask: RuleRequest) -> NotAvailable:
    lack = _lack(structure_of(ask))
    return not_available(ask, f"there is no room for it at your bases{lack}.", f"no room{lack.partition(';')[0]}")


# the order ------------------------------------------------------------------------------------------------------------


def _check_and_build(ask: RuleRequest, middle: WorldPoint) -> list[RuleOrder]:
    """Return the orders to build at the middle of some cells, which the host has not chosen itself."""
    _check_site(ask, land_of(ask.snapshot), middle)
    return _build(ask, middle)


def _build(ask: RuleRequest, middle: WorldPoint) -> list[RuleOrder]:
    """Return the orders to build at the middle of some cells."""
    structure = structure_of(ask)
    worker, queued = builder(ask, middle)
    orders = _go(ask, worker, middle, queued=queued)
    width, height = footprint_need(structure).size
    ask.ledger.promise(middle, width, height)
    if sites()[structure].addon:
        ask.ledger.promise(addon_place(middle), 2, 2)
    return orders


def _on_geyser(ask: RuleRequest, geyser: Unit) -> list[RuleOrder]:
    worker, queued = builder(ask, place(geyser))
    orders = _go(ask, worker, geyser.tag, queued=queued)
    ask.ledger.promise(place(geyser), 3, 3)
    return orders


def _go(ask: RuleRequest, worker: Unit, target: WorldPoint | int, *, queued: bool) -> list[RuleOrder]:
    ask.charge(ask.facts(name(worker)))
    ask.ledger.take(worker.tag)
    return [RuleOrder(ask.function, (worker.tag,), target, queued)]


def _back_to_work(ask: RuleRequest, build: RuleOrder) -> list[RuleOrder]:
    """Send a worker that outlives its work back to the mineral field that is nearest to where it built."""
    worker = ask.snapshot.units[build.units[0]]
    land = land_of(ask.snapshot)
    fields = [u for u in land.standing("mineral_field") if u.tag in ask.snapshot.units]
    if name(worker) == "Drone" or not fields:
        return []
    target = land.unit(build.target) if isinstance(build.target, int) else None
    where = place(target) if target is not None else build.target
    assert isinstance(where, WorldPoint)  # a structure is built at a point or on a unit
    field = min(fields, key=lambda unit: (math.dist(place(unit), where), unit.tag))
    return [RuleOrder(functions()["Harvest_Gather_screen"], build.units, field.tag, queued=True)]


# the place ------------------------------------------------------------------------------------------------------------


def _check_site(ask: RuleRequest, land: Land, middle: WorldPoint) -> None:
    """Raise an error if the structure cannot stand there, with the nearest place where it can."""
    structure = structure_of(ask)
    footprint = footprint_need(structure)
    allowed = legal(land, ask.ledger, structure)
    cell = footprint.cell(*middle)
    if land.ground.holds(*cell) and allowed[cell]:
        return
    other = best(allowed, near(land, [middle], corner=on_corner(structure)))
    raise NotAvailable(
        "invalid_target",
        f"{structure} cannot stand there: {_why_not(ask, land, cell)}",
        None if other is None else footprint.middle(other),
    )


def _why_not(ask: RuleRequest, land: Land, cell: tuple[int, int]) -> str:
    """Return why a structure cannot stand on a cell and those around it, as half a sentence."""
    site = sites()[structure_of(ask)]
    footprint = footprint_need(structure_of(ask))
    cells = [(cell[0] + dx, cell[1] + dy) for dx, dy in footprint.cells]
    if not all(land.ground.holds(x, y) and land.ground.buildable[x, y] for x, y in cells):
        return "a cliff, a ramp or the edge of the map is in its way."
    x, y = np.array(cells).T
    standing = land.standing_on(cells)
    again = (structure_of(ask), footprint.middle(cell)) in land.plans
    reasons = (
        (again, f"a {structure_of(ask)} is going to be built there already."),
        (land.taken[x, y].any(), f"a {name(standing) if standing else 'unit'} is in its way."),
        ((land.planned | promised_cells(land, ask.ledger))[x, y].any(), "something else is going to be built there."),
        (site.ground == "creep" and not land.creep[x, y].all(), "it needs creep under all of it."),
        (site.ground in ("bare", "powered") and land.creep[x, y].any(), "there is creep, on which only Zerg build."),
        (site.seen and (land.sight[x, y] < SEEN_NOW).any(), "the place has to be in sight."),
        (
            site.clear and not land.clear[x, y].all(),
            "it is too near to minerals or gas; 3 cells between have to be free.",
        ),
    )
    unpowered = "no Pylon or phasing WarpPrism powers that place; build a Pylon within 6 of it first."
    return next((why for so, why in reasons if so), unpowered)


def _lack(structure: str) -> str:
    """Return what is usually missing if a structure has no place."""
    match sites()[structure].ground:
        case "powered":
            return " in the field of a Pylon; build a Pylon first"
        case "creep":
            return " on creep; build another Hatchery or spread creep first"
        case _:
            return ""


def _landmark(ask: RuleRequest) -> Unit:
    """Return the unit that names the place; it may be one that is only remembered."""
    unit = None if ask.tag is None else land_of(ask.snapshot).unit(ask.tag)
    if unit is None:
        raise NotAvailable(
            "unknown_target", f"No unit {hex(ask.tag or 0)} is known; use a tag that stands in your lists."
        )
    return unit


def _base_of(ask: RuleRequest, unit: Unit) -> Base:
    """Return the place for a town hall beside a unit."""
    found = nearest_base(land_of(ask.snapshot), unit)
    if found is None:
        raise NotAvailable(
            "invalid_target",
            f"The {name(unit)} {hex(unit.tag)} is at no place for a town hall; name a mineral field or geyser there.",
        )
    return found


def nearest_base(land: Land, unit: Unit) -> Base | None:
    """Return the place for a town hall that a unit is at; None if it is at none."""
    found = min(land.bases, key=lambda base: (math.dist(base.place, place(unit)), base.place), default=None)
    return found if found is not None and math.dist(found.place, place(unit)) <= OF_BASE else None


def free_geysers(ask: RuleRequest) -> list[Unit]:
    """Return the geysers without a gas structure or a planned one, by ascending tags."""
    land = land_of(ask.snapshot)
    standing = land.standing("geyser")
    taken = {_spot(unit) for unit in standing if name(unit) in GAS_STRUCTURES}
    taken |= {(round((x0 + x1) / 2), round((y0 + y1) / 2)) for x0, y0, x1, y1 in ask.ledger.sites}
    aimed = {o.target_unit_tag for u in ask.snapshot.own for o in u.orders if o.ability_id == ask.function.ability_id}
    bare = [unit for unit in standing if name(unit) not in GAS_STRUCTURES]
    return [unit for unit in bare if _spot(unit) not in taken and unit.tag not in aimed and _has_gas(unit)]


def _spot(unit: Unit) -> tuple[int, int]:
    return round(unit.pos.x), round(unit.pos.y)


def _has_gas(unit: Unit) -> bool:
    """Return True if a geyser holds gas, or is only remembered, so that its content is unknown."""
    return unit.is_remembered or unit.vespene_contents > 0


# names ----------------------------------------------------------------------------------------------------------------


def structure_of(ask: RuleRequest) -> str:
    """Return the structure that an action builds."""
    structure = ask.action.produces
    assert structure is not None, f"{ask.action.name} builds something"
    return structure


def is_gas(ask: RuleRequest) -> bool:
    """Return True if an action's structure stands on a geyser."""
    return sites()[structure_of(ask)].ground == "geyser"
