"""Idleness: how long workers and production structures had nothing to do, for the score; checked once a second."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

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
    if world.hands_at != world.population:
        rows = world.type[world.live]
        world.hands = world.live[works[rows] | trains[rows]]
        world.hands_at = world.population
    hands = world.hands
    if not hands.size:
        return
    slots = hands[(world.order_kind[hands] == IDLE) & (world.build_progress[hands] >= 1.0)]
    for slot in slots.tolist():
        score = world.players[int(world.owner[slot])].score
        if works[world.type[slot]]:
            score.idle_worker_s += 1.0
        elif slot not in world.jobs:
            score.idle_production_s += 1.0
