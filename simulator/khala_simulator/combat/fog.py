"""Fog: what a player remembers of structures and resources where it sees nothing now.

Keeps the snapshots of ``World.memories`` up to date. Above: ``systems.vision``. Below: ``snapshots``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.world.players import NEUTRAL
from khala_simulator.world.snapshots import INDEX_SHIFT, TAG_BASE, RememberedUnit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.snapshots import FogMemory
    from khala_simulator.world.world import World

VISIBLE: Final = 2


def unknown_to(world: World, player: int, slots: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return those of some units that a player neither owns nor sees nor remembers; all know the neutral ones."""
    known = world.visible[player, slots] | (world.owner[slots] == player) | (world.owner[slots] == NEUTRAL)
    of_unit = world.memories[player].of_unit
    hidden = [slot for slot in slots[~known].tolist() if int(world.tag[slot]) not in of_unit]
    return np.array(hidden, dtype=np.int64)


def remember(world: World, player: int) -> None:
    """Update a player's memory with the player's sight in this loop."""
    memory = world.memories[player]
    slots = world.live[_stays(world.catalog)[world.type[world.live]] & (world.owner[world.live] != player)]
    seen = world.visible[player, slots]
    if not memory.made:  # the game shows where the neutral things are from the start
        seen = seen | (world.owner[slots] == NEUTRAL)
    _note(world, memory, slots[seen])
    in_sight = {int(world.tag[slot]) for slot in slots[world.visible[player, slots]].tolist()}
    hidden = [s for s in memory.of_unit.values() if s.unit not in in_sight]
    for snapshot in hidden:
        if _place_is_seen(world, player, snapshot):
            del memory.of_unit[snapshot.unit]
    memory.shown = [s for s in hidden if s.unit in memory.of_unit]


def _note(world: World, memory: FogMemory, slots: NDArray[np.int64]) -> None:
    """Remember units as they are now; most are resources and finished structures, the same as the last time."""
    columns = (world.tag, world.type, world.owner, world.pos, world.heading, world.build_progress)
    for tag, row, owner, (x, y), (hx, hy), progress in zip(*(c[slots].tolist() for c in columns), strict=True):
        known, now = memory.of_unit.get(tag), (row, owner, (x, y), (hx, hy), float(progress))
        if known is not None and now == (known.row, known.owner, known.pos, known.heading, known.build_progress):
            continue
        if known is None:
            memory.made += 1
        own_tag = TAG_BASE | memory.made << INDEX_SHIFT if known is None else known.tag
        memory.of_unit[tag] = RememberedUnit(own_tag, tag, *now)


def _place_is_seen(world: World, player: int, snapshot: RememberedUnit) -> bool:
    x, y = (int(v) for v in snapshot.pos)
    height, width = world.visibility[player].shape
    return 0 <= x < width and 0 <= y < height and bool(world.visibility[player, y, x] == VISIBLE)


@lru_cache(maxsize=4)
def _stays(catalog: Catalog) -> NDArray[np.bool_]:
    """Return [rows] which types leave snapshots: structures, resources and all others that never move."""
    return np.array([(u.structure or bool(u.resource)) and u.speed_n == 0.0 for u in catalog.units])
