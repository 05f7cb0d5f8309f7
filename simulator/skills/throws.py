"""Throws: what a spell sends on its way and what happens where it arrives.

A throw is a field that does nothing until it is due. The catalog says which spells have a missile and not how fast it
is; the speeds stand with the abilities (``missile_speed_n``, per normal second) and are estimates.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from simulator.catalog import LOOPS_PER_NORMAL_SECOND
from simulator.columns import NOBODY
from simulator.skills.skill import distance, gap, lay, number, place_of

if TYPE_CHECKING:
    from simulator.casts import Cast
    from simulator.fields import Field
    from simulator.world import World

SPEED_UNKNOWN = "How fast the missile flies."


def flight_loops(world: World, cast: Cast) -> int:
    """Loops from the throw until it arrives: at the point, or at the edge of the target where it stands now."""
    step = number(cast, "missile_speed_n") / LOOPS_PER_NORMAL_SECOND
    if cast.target == NOBODY:
        return math.ceil(distance(world, cast.slot, place_of(world, cast)) / step)
    return math.ceil((gap(world, cast.slot, cast.target) + float(world.radius[cast.slot])) / step)


def throw(world: World, cast: Cast, does: str, *, radius: float = 0.0, delay_loops: float = 0.0) -> Field:
    """Send something to where a cast is aimed; the field's rule ``does`` runs once, when it arrives."""
    due = world.loop + flight_loops(world, cast) + delay_loops
    item = lay(world, cast, does, end=due, due=due)
    item.radius, item.target = radius, world.tag_of(cast.target)
    return item
