"""Crawlers take root again: on creep, where their footprint fits. Pulling the roots up is an ordinary morph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from simulator.refusal import Refusal
from simulator.skills import teleport
from simulator.skills.skill import Skill, place_of
from simulator.systems.placement import snapped

if TYPE_CHECKING:
    from simulator.casts import Cast, Point
    from simulator.columns import Ints
    from simulator.world import World


def _root(world: World, cast: Cast) -> None:
    """Take root at a place on creep."""
    if _room(world, cast) is not Refusal.SUCCESS:
        return
    teleport.to(world, cast.slot, _spot(world, cast))
    world.become(cast.slot, world.catalog.unit(cast.ability.unit))


def _spot(world: World, cast: Cast) -> Point:
    footprint = world.catalog.footprints[world.catalog.unit(cast.ability.unit).footprint]
    return snapped(place_of(world, cast), footprint.size)


def _cells(world: World, cast: Cast) -> Ints:
    """(k, 2) the cells that the rooted crawler would block."""
    footprint = world.catalog.footprints[world.catalog.unit(cast.ability.unit).footprint]
    corner = np.floor(np.array(_spot(world, cast)) + 1e-9).astype(np.int64)
    cells: Ints = corner + np.array(footprint.cells, dtype=np.int64)
    return cells


def _room(world: World, cast: Cast) -> Refusal:
    """Whether the crawler may root there: free ground that can be built on, all of it on creep."""
    x, y = _cells(world, cast).T
    width, height = world.map.terrain.size
    if (x < 0).any() or (y < 0).any() or (x >= width).any() or (y >= height).any():
        return Refusal.CANT_FIND_PLACEMENT_LOCATION
    if not world.creep[y, x].all():
        return Refusal.CANT_BUILD_TOO_FAR_FROM_CREEP_SOURCE
    free = world.ground.walk[y, x].all() and world.map.terrain.build[y, x].all()
    return Refusal.SUCCESS if free else Refusal.CANT_FIND_PLACEMENT_LOCATION


SKILLS: Final = {
    "root": Skill(_root, refuse=_room, binds=True),
}
