"""The census: which kinds of units live in a world now, so that systems can skip kinds that are absent.

Taken again when a unit comes, dies or changes; nothing here decides anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from khala_simulator.world.world import World


@dataclass(frozen=True, slots=True)
class Census:
    """Whether any living unit has what each field says."""

    turrets: bool
    beams: bool
    rolling_guns: bool  # weapons that fire while the body goes where it wants
    guns_walking: bool  # and at what the unit passes
    drifting_flyers: bool  # flyers that need time to stop
    brakers: bool  # units that do
    low_priority_bodies: bool  # units of less push priority than the ordinary
    weapons_with_filters: bool  # units that can't aim at what is near, or do not aim at structures

    @classmethod
    def of(cls, world: World) -> Census:
        """Look at all living units."""
        slots = world.live
        units = [world.catalog.units[row] for row in sorted(set(world.type[slots].tolist()))]
        weapons = [weapon for unit in units for weapon in unit.weapons]
        return cls(
            turrets=any(w.turret_deg_n is not None for w in weapons),
            beams=any(w.is_beam for w in weapons),
            rolling_guns=any(w.moves == "moving" for w in weapons),
            guns_walking=bool(world.guns_walking[slots].any()),
            drifting_flyers=bool(world.glides[slots].any()),
            brakers=bool(np.isfinite(world.step_loss[slots]).any()),
            low_priority_bodies=bool((world.lightness[slots] != 1.0).any()),
            weapons_with_filters=bool(world.spares_structures[slots].any() or (world.least_range[slots] > 0.0).any()),
        )


def census(world: World) -> Census:
    """Return the census of a world, taken now if something has changed."""
    known = world.census
    if not isinstance(known, Census):
        known = world.census = Census.of(world)
    return known
