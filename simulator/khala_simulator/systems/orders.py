"""Orders: when the current one is finished, the next in the queue begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.abilities import commands
from khala_simulator.movement.arrival import packed
from khala_simulator.numeric.arrays import some, which
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.world import World

CROWD_PERIOD = 2
"""How often the density of the crowd at a goal is checked; of those who look for targets, whenever they have looked."""


def carry_out(world: World) -> None:
    """End every order whose point is reached or whose target is gone, and begin the next one."""
    for slot in _lost(world) + _arrived(world):
        commands.begin_next(world, slot)


def _lost(world: World) -> list[int]:
    """Return slots whose target is dead or out of their owner's sight; where nothing hides only a change does that."""
    if not (world.orders_changed or world.fog or world.hiding):
        return []
    world.orders_changed = False
    slots = which(world.needs_target[: world.top])
    if not slots.size:
        return []
    target = world.order_target.take(slots)
    lost = (target == NOBODY) | ~world.visible[world.owner.take(slots), target]
    return slots[lost].tolist() if some(lost) else []


def _arrived(world: World) -> list[int]:
    """Return slots whose walk has reached its point, or as near as the crowd there or the terrain allows.

    Units that look for targets on their way have just looked in vain: if not, an attack on a place would end as soon as
    the first enemy there is dead.
    """
    n = world.top
    walks, looks = world.walks[:n], world.looks_around[:n]
    just_looked = world.loop % MECHANICS.scan_period == 1
    if some(looks & walks):
        looked = just_looked & (world.scan_loop[:n] > world.loop)
        walks = walks & (~looks | (world.target[:n] == NOBODY) & (looked | ~world.acquires[:n]))
    walkers = which(walks)
    if not walkers.size:
        return []
    offset = world.order_point.take(walkers, 0) - world.pos.take(walkers, 0)
    offset *= offset
    squared = offset[:, 0] + offset[:, 1]
    there = squared <= MECHANICS.arrival_radius**2
    there |= world.nav_end.take(walkers)
    if just_looked or world.loop % CROWD_PERIOD == 0:
        stuck = world.blocked.take(walkers) > 0
        stuck |= world.loop - world.nav_best_loop.take(walkers) > MECHANICS.crowd_stall
        stuck &= ~there
        if some(stuck):
            there[stuck] = packed(world, walkers[stuck])
    return walkers[there].tolist() if some(there) else []
