"""Crowds: when a walker whose way is blocked by others is near enough to its goal.

The game's own rule is not known; this one is an estimate. Used by ``systems.orders``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.native import columns, memory
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

BLOCKED_LOOPS: Final = 2
ROUNDING: Final = 1e-9  # more than the order of a sum makes of it, relatively
CROWD_NEAR: Final = MECHANICS.crowd_near
CROWD_SHARE: Final = MECHANICS.crowd_share
CROWD_PATIENCE: Final = MECHANICS.crowd_patience
CROWD_STALL: Final = MECHANICS.crowd_stall


class ArrivalCrowd:
    """The bodies in the world at one loop."""

    def __init__(self, world: World) -> None:
        c = columns.columns_of(world)
        self.live = world.live
        self.slots = memory.ints(self.live)
        self.units = len(self.live)
        self.loop = world.loop
        self.area = 0.0  # that all of them fill that can walk
        for i in range(self.units):
            slot = self.slots[i]
            if c.step_max[slot] > 0.0:
                self.area += c.separation[slot] * c.separation[slot]


def has_stalled(c: Columns, slot: int, loop: int) -> bool:
    """Return whether a unit has come no nearer to its goal for long, since its way was checked after its order."""
    return c.nav_loop[slot] > 0 and loop - c.nav_best_loop[slot] > CROWD_STALL


def is_packed(c: Columns, crowd: ArrivalCrowd, slot: int) -> bool:
    """Return whether a walker has come as near to its goal as the crowd allows.

    That is when it stands before others close to the goal, when friends fill the ground between it and the goal, or
    when it is within the area that all who walk would fill and has come no nearer for long.
    """
    x = c.nav_goal[slot].x - c.pos[slot].x
    y = c.nav_goal[slot].y - c.pos[slot].y
    squared = x * x + y * y
    near = c.separation[slot] + CROWD_NEAR
    if c.blocked[slot] >= CROWD_PATIENCE and squared < near * near:
        return True
    if not _fills(c, crowd, NOBODY, squared, crowd.area):  # no walker is packed farther out than this
        return False
    if has_stalled(c, slot, crowd.loop):
        return True
    return c.blocked[slot] >= BLOCKED_LOOPS and _is_filled(c, crowd, slot, squared)


def _is_filled(c: Columns, crowd: ArrivalCrowd, slot: int, squared: float) -> bool:
    """Return whether friends fill the ground between a walker and its goal."""
    area = 0.0
    enough = CROWD_SHARE * squared * (1.0 + ROUNDING)
    for i in range(crowd.units):
        other = crowd.slots[i]
        if _is_inside(c, slot, other, squared):
            area += c.separation[other] * c.separation[other]
            if area > enough:
                return True
    return _fills(c, crowd, slot, squared, area)


def _fills(c: Columns, crowd: ArrivalCrowd, slot: int, squared: float, area: float) -> bool:
    """Return whether an area is as large as it must be at a distance; where the order of its sum matters, measure."""
    wanted = CROWD_SHARE * squared
    if abs(area - wanted) > wanted * ROUNDING:
        return area > wanted
    return _area(c, crowd, slot, squared) >= wanted


def _is_inside(c: Columns, slot: int, other: int, squared: float) -> bool:
    """Return whether another body is a friend in the way that is nearer to a walker's goal."""
    x = c.pos[other].x - c.nav_goal[slot].x
    y = c.pos[other].y - c.nav_goal[slot].y
    return (
        x * x + y * y < squared
        and c.owner[other] == c.owner[slot]
        and c.layer_bits[other] & c.layer_bits[slot] != 0
        and other != slot
    )


def _area(c: Columns, crowd: ArrivalCrowd, slot: int, squared: float) -> float:
    """Return the area of the bodies between a walker and its goal, or of all who walk for NOBODY, summed in pairs."""
    areas = memory.new_floats(crowd.units)
    cells = memory.floats(areas)
    for i in range(crowd.units):
        other = crowd.slots[i]
        is_inside = c.step_max[other] > 0.0 if slot == NOBODY else _is_inside(c, slot, other, squared)
        cells[i] = c.separation[other] * c.separation[other] if is_inside else 0.0
    return memory.pairwise_sum(cells, crowd.units)
