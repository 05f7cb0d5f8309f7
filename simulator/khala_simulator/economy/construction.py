"""Construction: how a structure, or a unit that is warped in, begins, is called off and is finished.

Life and shields grow with the work done on a structure; a unit that is warped in has all of them at once. The loop by
loop progress is ``systems.construction``'s. Above: ``skills.construction``, ``skills.addons``, ``skills.warpgate``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.combat import lifecycle
from khala_simulator.combat.traits import refresh
from khala_simulator.economy import payments
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.world import Death

if TYPE_CHECKING:
    from khala_simulator.tables.prices import Cost
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

STRUCTURE_FACING: Final = 4.7124
START_SHARE: Final = 0.1  # of life and shields that a structure has when it is begun
SEEN_LATER: Final = 1.0  # an order that takes effect at once does so a loop before its product is first seen
NO_KILLER: Final = -1


def begin(
    world: World, unit: UnitType, owner: int, point: Point, *, loops: float, paid: Cost, by_itself: bool = True
) -> int:
    """Put an unfinished structure or unit into the world; return its slot.

    Args:
        world: The game.
        unit: What it will be.
        owner: Its owner.
        point: Its exact centre.
        loops: Loops of work until it is finished.
        paid: The price that was charged; a part comes back when it is called off.
        by_itself: Whether the work goes on without a builder.
    """
    slot = lifecycle.spawn(world, unit, owner, point, STRUCTURE_FACING)
    world.build_progress[slot] = 0.0
    world.build_loops[slot] = max(loops, 1.0)
    world.self_made[slot] = by_itself
    world.invested[slot] = paid
    if unit.structure:
        world.life[slot] = START_SHARE * world.life_max[slot]
        world.shields[slot] = START_SHARE * world.shields_max[slot]
    refresh(world, slot)
    return slot


def finish(world: World, slot: int) -> None:
    """Make a unit complete."""
    unit = world.unit_type(slot)
    owner = int(world.owner[slot])
    world.build_progress[slot] = 1.0
    world.build_loops[slot] = 0.0
    world.invested.pop(slot, None)
    refresh(world, slot)
    world.powered_at = -1
    world.scan_now = world.orders_changed = True
    world.alert(owner, "BuildingComplete" if unit.structure else "WarpInComplete")


def call_off(world: World, slot: int) -> None:
    """Take an unfinished structure or unit out of the world; refund a part of its price, and its drone."""
    owner = int(world.owner[slot])
    unit = world.unit_type(slot)
    x, y = world.pos[slot].tolist()
    payments.refund(world, owner, world.invested.get(slot, (0.0, 0.0)), payments.CANCELLED)
    world.deaths.append(Death(world.loop, world.tag_of(slot), unit.id, owner, NO_KILLER))
    drone = unit.structure and unit.race == "zerg" and any(way.producer == "Drone" for way in unit.made_by)
    lifecycle.remove(world, slot)
    if drone:
        lifecycle.spawn(world, world.catalog.unit("Drone"), owner, (x, y))


def builder_of(world: World, site: int) -> int:
    """Return the slot of the unit that is working on a site, or NOBODY."""
    found = (world.site[: world.top] == site).nonzero()[0]
    return int(found[0]) if found.size else NOBODY
