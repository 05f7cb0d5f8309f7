"""Idleness: how long workers and production structures had nothing to do, for the score; checked once a second."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.native import columns, memory
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Bools
    from khala_simulator.world.world import World

IDLE: Final = int(OrderKind.IDLE)


@lru_cache(maxsize=4)
def _rows(catalog: Catalog) -> tuple[Bools, Bools]:
    """Return, by unit row, which types are workers, and which structures train."""
    trains = [u.structure and any(a.effect == "train" for a in catalog.abilities_of(u.row)) for u in catalog.units]
    return np.array([u.worker for u in catalog.units]), np.array(trains)


def count(world: World) -> None:
    """Add a second for every unit that is idle at the end of it."""
    if world.loop % LOOPS_PER_NORMAL_SECOND:
        return
    works, trains = _rows(world.catalog)
    works_by_row = memory.bools(works)
    trains_by_row = memory.bools(trains)
    c = columns.columns_of(world)
    live = world.live
    slots = memory.ints(live)
    for i in range(len(live)):
        slot = slots[i]
        works_here = works_by_row[c.type[slot]]
        if not works_here and not trains_by_row[c.type[slot]]:
            continue
        if c.order_kind[slot] != IDLE or c.build_progress[slot] < 1.0:
            continue
        score = world.players[c.owner[slot]].score
        if works_here:
            score.idle_worker_s += 1.0
        elif slot not in world.jobs:
            score.idle_production_s += 1.0
