"""Harvesting: how workers, resources and town halls belong together, and how a round begins and ends.

A worker goes to its resource, stays there for the resource's time, carries what it took to the nearest town hall and
begins again; ``systems.harvest`` leads it through the phases. This module has the questions (which field is free, which
town hall is nearest, which worker is assigned where) and the steps that orders share with the system. Above:
``commands``, ``systems.harvest``, ``skills.harvest``, the API. Below: the world's columns.
"""

from __future__ import annotations

from enum import IntEnum
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import buffs, lifecycle
from khala_simulator.economy import touching
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Bools, Floats, Ints
    from khala_simulator.world.world import World

MINERALS: Final = "minerals"
ORDINARY_TRIP: Final = 5
GAS_BUFFS: Final = {
    "terran": "CarryHarvestableVespeneGeyserGas",
    "protoss": "CarryHarvestableVespeneGeyserGasProtoss",
    "zerg": "CarryHarvestableVespeneGeyserGasZerg",
}
MINERAL_BUFFS: Final = ("CarryMineralFieldMinerals", "CarryHighYieldMineralFieldMinerals")
CARRIED: Final = (*MINERAL_BUFFS, *GAS_BUFFS.values())


class Phase(IntEnum):
    """Where in its round a worker is."""

    NONE = 0
    TO_RESOURCE = 1
    AT_RESOURCE = 2
    LEAVING = 3
    TO_HALL = 4


@lru_cache(maxsize=4)
def kinds(catalog: Catalog) -> tuple[Bools, Bools, Bools]:
    """Return, by unit row, which types are harvestable (fields and gas structures), fields, and drop-offs."""
    fields = np.array([u.resource == MINERALS for u in catalog.units])
    gas = np.array([u.resource == "vespene" and u.harvest_loops > 0.0 for u in catalog.units])
    halls = np.array([u.structure and "DropOff" in u.placement and not u.flying for u in catalog.units])
    return fields | gas, fields, halls


@lru_cache(maxsize=4)
def harvesters(catalog: Catalog) -> tuple[tuple[Ability | None, Ability | None], ...]:
    """Return, by unit row, the abilities with which units of the type gather and return, None for other types."""
    found = []
    for card in catalog.cards:
        gather = next((a for a in card if a.effect == "gather"), None)
        back = next((a for a in card if a.effect == "return"), None)
        found.append((gather, back))
    return tuple(found)


def can_harvest(world: World, slot: int, resource: int) -> bool:
    """Return whether a unit can take from a field, or from a finished gas structure of its owner."""
    if harvesters(world.catalog)[int(world.type[slot])][0] is None or resource == NOBODY:
        return False
    takes, fields, _ = kinds(world.catalog)
    row = int(world.type[resource])
    if not takes[row]:
        return False
    if fields[row]:
        return True
    finished = world.build_progress[resource] >= 1.0
    return bool(world.owner[resource] == world.owner[slot] and finished)


def is_drop_off(world: World, slot: int) -> bool:
    """Return whether workers can drop off resources at a unit."""
    return bool(kinds(world.catalog)[2][int(world.type[slot])] and world.build_progress[slot] >= 1.0)


def nearest_hall(world: World, slot: int) -> int:
    """Return the owner's nearest finished town hall on the ground, or NOBODY."""
    live = world.live
    mine = kinds(world.catalog)[2][world.type[live]] & (world.owner[live] == world.owner[slot])
    mine &= world.build_progress[live] >= 1.0
    return _nearest(world, slot, live[mine])


def _nearest(world: World, slot: int, candidates: Ints) -> int:
    if not candidates.size:
        return NOBODY
    offset = world.pos[candidates] - world.pos[slot]
    return int(candidates[np.argmin(offset[:, 0] ** 2 + offset[:, 1] ** 2)])


# where workers are ----------------------------------------------------------------------------------------------------


def workers_per_resource(world: World) -> Ints:
    """Return (capacity,) how many workers each resource has, whatever phase they are in."""
    patches = world.patch[(world.harvest > 0) & (world.patch != NOBODY)]
    return np.bincount(patches, minlength=world.capacity)


def staffing(world: World, player: int) -> dict[int, tuple[int, int]]:
    """Return the workers of a player's town halls and gas structures (assigned, ideal), by slot.

    A town hall counts the workers on the mineral fields around it, and wants two for each.
    """
    takes, fields, halls = kinds(world.catalog)
    workers = workers_per_resource(world)
    live = world.live
    rows = world.type[live]
    found: dict[int, tuple[int, int]] = {}
    mine = (world.owner[live] == player) & (world.build_progress[live] >= 1.0)
    for slot in live[mine & takes[rows]].tolist():
        left = world.contents[slot] > 0
        found[slot] = int(workers[slot]), world.unit_type(slot).ideal_harvesters if left else 0
    patches = live[fields[rows]]
    for slot in live[mine & halls[rows]].tolist():
        offset = world.pos[patches] - world.pos[slot]
        near = patches[offset[:, 0] ** 2 + offset[:, 1] ** 2 <= MECHANICS.harvest_search**2]
        ideal = sum(world.unit_type(patch).ideal_harvesters for patch in near.tolist())
        found[slot] = int(workers[near].sum()), ideal
    return found


def another_field(world: World, slot: int, near: Floats, *, waiting: int = NOBODY) -> int:
    """Return the mineral field near a point that a worker changes to, or NOBODY.

    A free field that no other worker is going to comes first, then the one with the fewest workers, then the nearest. A
    worker that stands before the field ``waiting`` leaves it only for one with fewer workers.
    """
    live = world.live
    near_by = kinds(world.catalog)[1][world.type[live]]
    offset = world.pos[live] - near
    near_by &= offset[:, 0] ** 2 + offset[:, 1] ** 2 <= MECHANICS.harvest_search**2
    fields = live[near_by]
    if not fields.size:
        return NOBODY
    workers = workers_per_resource(world)[fields].astype(np.float64)
    if waiting != NOBODY:
        workers[fields == waiting] -= 1.0
    away = world.pos[fields] - world.pos[slot]
    distance = np.sqrt(away[:, 0] ** 2 + away[:, 1] ** 2)
    best = int(np.lexsort((fields, distance, workers))[0])
    if waiting != NOBODY and workers[best] >= workers[fields == waiting].sum():
        return NOBODY
    return int(fields[best])


# the round ------------------------------------------------------------------------------------------------------------


def leave(world: World, slot: int) -> None:
    """Release the resource that a worker is at."""
    patch = int(world.patch[slot])
    if patch != NOBODY and world.occupant[patch] == slot:
        world.occupant[patch] = NOBODY
        world.work_until[patch] = world.loop + MECHANICS.harvest_handover
    if world.carrier[slot] != NOBODY and world.carrier[slot] == patch:
        x, y = _door(world, slot, patch)
        lifecycle.unstow(world, slot, (x, y))
        world.looks_around[slot] = False


def _door(world: World, slot: int, patch: int) -> tuple[float, float]:
    """Return where a worker comes out of a gas structure: on the side of its town hall."""
    hall = nearest_hall(world, slot)
    centre = world.pos[patch]
    towards = (world.pos[hall] if hall != NOBODY else world.pos[slot]) - centre
    length = float(np.hypot(*towards)) or 1.0
    x, y = (centre + towards / length * touching.distance_in(world, slot, patch)).tolist()
    return x, y


def head_for_resource(world: World, slot: int, patch: int) -> None:
    """Send a gathering worker to a resource, and write that as its order."""
    gather = harvesters(world.catalog)[int(world.type[slot])][0]
    world.patch[slot] = patch
    _head_for(world, slot, patch, Phase.TO_RESOURCE, gather)


def head_for_hall(world: World, slot: int) -> bool:
    """Send a worker with its load to the nearest town hall; return False when there is none."""
    hall = nearest_hall(world, slot)
    if hall == NOBODY:
        return False
    _head_for(world, slot, hall, Phase.TO_HALL, harvesters(world.catalog)[int(world.type[slot])][1])
    return True


def _head_for(world: World, slot: int, target: int, phase: Phase, ability: Ability | None) -> None:
    world.harvest[slot] = phase
    world.order_ability[slot] = 0 if ability is None else ability.id
    world.order_target[slot] = target
    world.nav_loop[slot] = world.blocked[slot] = world.detour[slot] = 0
    world.nav_end[slot] = False


def take_up(world: World, slot: int, amount: int, *, gas: bool, rich: bool) -> None:
    """Make a worker carry resources; clients see it as a buff."""
    put_down(world, slot)
    world.load[slot] = amount
    name = GAS_BUFFS[world.unit_type(slot).race] if gas else MINERAL_BUFFS[rich]
    buffs.apply(world, slot, name, source=slot)


def put_down(world: World, slot: int) -> None:
    """Remove a worker's load, without giving it to a player."""
    if world.load[slot]:
        world.load[slot] = 0
        for name in CARRIED:
            if buffs.remove(world, slot, name):
                return


def carries_gas(world: World, slot: int) -> bool:
    """Return whether a worker's load is vespene."""
    return any(buffs.has(world, slot, name) for name in GAS_BUFFS.values())
