"""Supply: how much a player's units use, and how much the structures provide.

A unit in training counts from its start; one that only waits in a queue does not count. Above: ``casting``,
``production``, the API. Below: the world.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Floats
    from khala_simulator.world.world import World

LIMIT: Final = 200.0


@lru_cache(maxsize=4)
def _columns(catalog: Catalog) -> tuple[Floats, Floats]:
    """Return, by unit row, what one uses, and what one provides."""
    return np.array([u.supply for u in catalog.units]), np.array([u.provides for u in catalog.units])


def in_use(world: World, player: int) -> float:
    """Return the supply that a player's units use, those in transports and in production included."""
    n = world.top
    mine = world.alive[:n] & (world.owner[:n] == player) & ~world.hallucination[:n]
    return float(_columns(world.catalog)[0][world.type[:n][mine]].sum()) + begun(world, player)


def begun(world: World, player: int) -> float:
    """Return the supply of units in production, and the extra supply of units that grow into larger ones."""
    if not (world.jobs or world.channelling):
        return 0.0
    jobs = sum(job.supply for jobs in world.jobs.values() for job in jobs if job.begun and job.owner == player)
    growing = (c.ability for c in world.channelling.values() if c.ability.supply and world.owner[c.slot] == player)
    return jobs + sum(ability.supply for ability in growing)


def cap(world: World, player: int) -> float:
    """Return the supply that a player's finished units and structures provide, at most the game's limit."""
    slots = world.units_of(player)
    whole = slots[world.build_progress[slots] >= 1.0]
    provided = float(_columns(world.catalog)[1][world.type[whole]].sum())
    if len(world.buffs):
        extra = np.array([buff.supply for buff in world.catalog.buffs])
        rows = world.buffs.rows
        provided += float(extra[rows["buff"][world.owner[rows["slot"]] == player]].sum())
    return min(LIMIT, provided)


def has_room(world: World, player: int, amount: float) -> bool:
    """Return whether a player can use so much more supply; always true with the debug state for food."""
    if amount <= 0.0 or "food" in world.players[player].cheats:
        return True
    return in_use(world, player) + amount <= cap(world, player)
