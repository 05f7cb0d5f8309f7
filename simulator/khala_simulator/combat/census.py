"""The census: which kinds of units live in a world now, so that systems can skip kinds that are absent.

Taken again when a unit comes, dies or changes; nothing here decides anything.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from khala_simulator.native import columns, memory

if TYPE_CHECKING:
    from khala_simulator.world.world import World


class Census:
    """Whether any living unit has what an attribute says.

    Attributes:
        turrets: A turret.
        beams: A weapon that goes on by itself.
        rolling_guns: A weapon that fires while the body goes where it wants.
        guns_walking: One that fires at what the unit passes, too.
        drifting_flyers: Wings, and needs time to stop.
        brakers: Needs time to stop.
        weapons_with_filters: Can't aim at what is near, or does not aim at structures.
    """

    def __init__(self, world: World) -> None:
        c = columns.columns_of(world)
        stats = world.stats
        turrets = memory.bools(stats.has_turret)
        beams = memory.bools(stats.has_beam)
        rolling = memory.bools(stats.has_rolling_gun)
        self.turrets = False
        self.beams = False
        self.rolling_guns = False
        self.guns_walking = False
        self.drifting_flyers = False
        self.brakers = False
        self.weapons_with_filters = False
        live = world.live
        slots = memory.ints(live)
        for i in range(len(live)):
            slot = slots[i]
            self.turrets = self.turrets or turrets[c.type[slot]]
            self.beams = self.beams or beams[c.type[slot]]
            self.rolling_guns = self.rolling_guns or rolling[c.type[slot]]
            self.guns_walking = self.guns_walking or c.guns_walking[slot]
            self.drifting_flyers = self.drifting_flyers or c.glides[slot]
            self.brakers = self.brakers or math.isfinite(c.step_loss[slot])
            self.weapons_with_filters = (
                self.weapons_with_filters or c.spares_structures[slot] or c.least_range[slot] > 0.0
            )

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Return what makes None: a copy of a world takes its own."""
        return type(None), ()


def census(world: World) -> Census:
    """Return the census of a world, taken now if something has changed."""
    if world.census is None:
        world.census = Census(world)
    known: Census = world.census  # type: ignore[assignment]  # a world does not know its census
    return known
