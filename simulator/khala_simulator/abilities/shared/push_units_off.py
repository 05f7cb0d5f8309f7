"""Push units off the cells of a structure that appears, such as a depot that rises."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.abilities.shared import teleport
from khala_simulator.tables.stats import GROUND_PLANE

if TYPE_CHECKING:
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

JUST_TOUCHING = 1e-6


def push_units_off(world: World, slot: int) -> None:
    """Move the units off the cells of a structure that has just appeared, each to the nearest free place."""
    cells = world.footprint_cells(slot)
    if not len(cells) or world.unit_type(slot).underfoot:
        return
    for other in _on(world, cells).tolist():
        x, y = world.pos[other].tolist()
        place = teleport.spot_near(world, other, (x, y))
        if place is not None and world.step_max[other] > 0.0:
            teleport.to(world, other, place)


def _on(world: World, cells: Ints) -> Ints:
    """Return the slots of the units on the ground that reach into the box around the cells."""
    slots = world.live
    solid = (world.plane_bits[slots] & GROUND_PLANE != 0) & (world.layer_bits[slots] != 0)
    slots = slots[solid & ~world.walled[slots]]
    low = cells.min(axis=0)
    high = cells.max(axis=0) + 1
    offset = world.pos[slots] - np.clip(world.pos[slots], low, high)
    inside = offset[:, 0] ** 2 + offset[:, 1] ** 2 < world.separation[slots] ** 2 - JUST_TOUCHING
    found: Ints = slots[inside]
    return found
