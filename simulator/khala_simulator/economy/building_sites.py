"""Sites: where a structure may stand; builders, the API's query and the computer player ask here.

The rules are those of the placement footprint in the tables: buildable ground, no unit on it, distance to resources,
creep, power, and gas structures on geysers only. A plan is judged by what the player knows; what is cloaked, burrowed
or in the fog is only in the way of a builder that has arrived. Above: ``skills.construction``, ``skills.addons``,
``api.query``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import fog
from khala_simulator.economy import power
from khala_simulator.movement.placement import snap
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind
from khala_simulator.world.players import NEUTRAL

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.records import UnitFootprint, UnitType
    from khala_simulator.world.casts import Point
    from khala_simulator.world.columns import Bools, Ints
    from khala_simulator.world.world import World

CAPS: Final = "Footprint3x3CappedGeyser"
VISIBLE: Final = 2  # in sight, 1 is explored; most structures may be placed in unexplored places
ON_GEYSER: Final = 0.5  # how far from a geyser's middle a gas structure may be asked for


def footprint_of(world: World, unit: UnitType) -> UnitFootprint | None:
    """Return the cells that a structure needs; for an add-on those of its own only."""
    name = unit.footprint if "AddOn" in unit.placement else unit.placement or unit.footprint
    found = world.catalog.footprints.get(name)
    return found if found is not None and found.cells else None


def centre(world: World, unit: UnitType, point: Point) -> Point:
    """Return the exact centre of a structure that is requested at a point."""
    footprint = footprint_of(world, unit)
    return point if footprint is None else snap(point, footprint.size)


def refusal(world: World, player: int, unit: UnitType, point: Point, *, on_site: bool = False) -> ActionResult:
    """Return why a player can't place a structure at a point, or success, for any builder.

    ``on_site``: by what is there; otherwise by what the player knows of it.
    """
    footprint = footprint_of(world, unit)
    if footprint is None:
        return ActionResult.NOT_SUPPORTED
    if footprint.id == CAPS:
        free = geyser_at(world, point)
        return ActionResult.SUCCESS if free != NOBODY else ActionResult.CANT_BUILD_LOCATION_INVALID
    x, y = snap(point, footprint.size)
    cells = np.floor([x + 1e-9, y + 1e-9]).astype(np.int64) + np.array(footprint.cells, dtype=np.int64)
    return (
        _of_ground(world, player, footprint, cells)
        or _of_units(world, player, cells, on_site=on_site)
        or _of_resources(world, footprint, cells)
        or _of_creep(world, player, footprint, cells, on_site=on_site)
        or _of_power(world, player, unit, (x, y))
        or ActionResult.SUCCESS
    )


def _of_ground(world: World, player: int, footprint: UnitFootprint, cells: Ints) -> ActionResult | None:
    terrain = world.map.terrain
    width, height = terrain.size
    x, y = cells[:, 0], cells[:, 1]
    if not ((x >= 0) & (y >= 0) & (x < width) & (y < height)).all():
        return ActionResult.CANT_BUILD_LOCATION_INVALID
    buildable = terrain.build if "NoBuild" in footprint.forbids else terrain.walk
    if not buildable[y, x].all():
        return ActionResult.CANT_BUILD_LOCATION_INVALID
    if "Fogged" in footprint.forbids and (world.visibility[player, y, x] < VISIBLE).any():
        return ActionResult.CANT_SEE_BUILD_LOCATION
    return None


def _of_units(world: World, player: int, cells: Ints, *, on_site: bool) -> ActionResult | None:
    on_it = _enemies_on(world, player, cells)
    if taken(world)[cells[:, 1], cells[:, 0]].any():
        on_it = np.concatenate((on_it, _standing_on(world, cells)))
    hidden = 0 if on_site else len(fog.unknown_to(world, player, on_it))
    return ActionResult.CANT_BUILD_ON_THAT if len(on_it) > hidden else None


def _enemies_on(world: World, player: int, cells: Ints) -> Ints:
    """Return the units of others that stand in the way; own units make room."""
    low = cells.min(axis=0)
    high = cells.max(axis=0) + 1
    live = world.live
    others = live[(world.owner[live] != player) & (world.layer_bits[live] != 0) & ~world.walled[live]]
    others = others[world.layer[others] != 2]
    found: Ints = others[((world.pos[others] > low) & (world.pos[others] < high)).all(axis=1)]
    return found


def _standing_on(world: World, cells: Ints) -> Ints:
    """Return the structures and resources on any of the cells."""
    wanted = {(x, y) for x, y in cells.tolist()}
    walled = world.live[world.walled.take(world.live)].tolist()
    found = [s for s in walled if any((x, y) in wanted for x, y in world.footprint_cells(s).tolist())]
    return np.array(found, dtype=np.int64)


def taken(world: World) -> Bools:
    """Return (h, w) the cells with structures and resources on them, walkable ones included."""
    if world.taken is not None and world.taken[0] == world.population:
        return world.taken[1]
    width, height = world.map.terrain.size
    grid: Bools = np.zeros((height, width), dtype=np.bool_)
    for slot in world.live[world.walled.take(world.live)].tolist():
        cells = world.footprint_cells(slot)
        inside = (cells >= 0).all(axis=1) & (cells[:, 0] < width) & (cells[:, 1] < height)
        grid[cells[inside, 1], cells[inside, 0]] = True
    world.taken = world.population, grid
    return grid


def _of_resources(world: World, footprint: UnitFootprint, cells: Ints) -> ActionResult | None:
    if "NearResources" not in footprint.forbids:
        return None
    wanted = {(x, y) for x, y in cells.tolist()}
    live = world.live
    for slot in live[world.owner[live] == NEUTRAL].tolist():
        unit = world.unit_type(slot)
        mask = world.catalog.footprints.get(unit.footprint) if unit.resource else None
        if mask is None:
            continue
        x, y = np.floor(world.pos[slot] + 1e-9).astype(np.int64).tolist()
        if any((x + dx, y + dy) in wanted for dx, dy in (*mask.cells, *mask.around)):
            return ActionResult.CANT_BUILD_TOO_CLOSE_TO_RESOURCES
    return None


def _of_creep(
    world: World, player: int, footprint: UnitFootprint, cells: Ints, *, on_site: bool
) -> ActionResult | None:
    x, y = cells[:, 0], cells[:, 1]
    on_creep = world.creep[y, x]
    if "Creep" in footprint.requires and not on_creep.all():
        return ActionResult.CANT_BUILD_TOO_FAR_FROM_CREEP_SOURCE
    seen = on_creep if on_site else on_creep & (world.visibility[player, y, x] == VISIBLE)
    if "Creep" in footprint.forbids and seen.any():
        return ActionResult.CANT_BUILD_ON_THAT
    return None


def _of_power(world: World, player: int, unit: UnitType, point: Point) -> ActionResult | None:
    if unit.needs_power and power.best(world, player, point) is None:
        return ActionResult.CANT_BUILD_TOO_FAR_FROM_POWER
    return None


def planned_structures(world: World, player: int) -> list[tuple[UnitType, Point]]:
    """Return what a player's units are on their way to build, and where, in the order of slots."""
    found: list[tuple[UnitType, Point]] = []
    for slot in world.units_of(player).tolist():
        if not world.casts[slot] and not world.queue[slot]:
            continue
        for order in world.orders_of(slot):
            ability = world.catalog.ability_of_id.get(order.ability)
            unit = product(world, ability) if ability is not None and ability.effect == "build" else None
            victim = world.slot_of(order.target)
            if unit is not None and order.kind is OrderKind.CAST and (order.point is not None or victim != NOBODY):
                x, y = order.point or world.pos[victim].tolist()
                found.append((unit, centre(world, unit, (x, y))))
    return found


# geysers --------------------------------------------------------------------------------------------------------------


def is_free_geyser(world: World, slot: int) -> bool:
    """Return whether a gas structure may be built on a unit."""
    unit = world.unit_type(slot)
    bare = unit.resource == "vespene" and unit.harvest_loops == 0.0
    return bare and world.occupant[slot] == NOBODY


def geyser_at(world: World, point: Point) -> int:
    """Return the geyser without a gas structure whose centre is at a point, or NOBODY."""
    live = world.live
    offset = np.abs(world.pos[live] - point)
    near = live[(offset <= ON_GEYSER).all(axis=1)]
    return next((s for s in near.tolist() if is_free_geyser(world, s)), NOBODY)


def product(world: World, ability: Ability) -> UnitType | None:
    """Return the structure that an ability builds, or None when the tables lack it."""
    row = world.catalog.row_of_name.get(ability.unit)
    return None if row is None else world.catalog.units[row]
