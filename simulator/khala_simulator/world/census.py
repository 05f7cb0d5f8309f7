"""The census: which kinds of units live in a world now, so that systems can skip kinds that are absent.

Taken again when a unit comes, dies or changes; nothing here decides anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.numeric.arrays import some

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
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
        turrets, beams, rolling_guns = _arms(world.catalog, frozenset(world.type.take(slots).tolist()))
        return cls(
            turrets=turrets,
            beams=beams,
            rolling_guns=rolling_guns,
            guns_walking=some(world.guns_walking.take(slots)),
            drifting_flyers=some(world.glides.take(slots)),
            brakers=some(np.isfinite(world.step_loss.take(slots))),
            low_priority_bodies=some(world.lightness.take(slots) != 1.0),
            weapons_with_filters=some(world.spares_structures.take(slots) | (world.least_range.take(slots) > 0.0)),
        )


@lru_cache(maxsize=256)
def _arms(catalog: Catalog, rows: frozenset[int]) -> tuple[bool, bool, bool]:
    """Return whether the types in these rows have turrets, beams, and weapons that fire while they move."""
    weapons = [weapon for row in rows for weapon in catalog.units[row].weapons]
    return (
        any(w.turret_deg_n is not None for w in weapons),
        any(w.is_beam for w in weapons),
        any(w.moves == "moving" for w in weapons),
    )


def census(world: World) -> Census:
    """Return the census of a world, taken now if something has changed."""
    known = world.census
    if not isinstance(known, Census):
        known = world.census = Census.of(world)
    return known
