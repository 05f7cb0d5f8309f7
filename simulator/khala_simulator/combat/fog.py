"""Fog: what a player remembers of structures and resources where it sees nothing now.

Keeps the snapshots of ``World.memories`` up to date. Above: ``systems.vision``. Below: ``snapshots``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala_simulator.numeric.arrays import some, which
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
    memory, owner = world.memories[player], world.owner.take(world.live)
    slots = world.live[leave_snapshots(world.catalog).take(world.type.take(world.live)) & (owner != player)]
    visible = world.visible[player].take(slots)
    seen = visible
    if not memory.made:  # the game shows where the neutral things are from the start
        seen = visible | (world.owner.take(slots) == NEUTRAL)
    columns = [c.take(slots[seen], 0) for c in (world.tag, world.type, world.owner, world.pos, world.heading)]
    columns.append(world.build_progress.take(slots[seen]))
    noted = b"".join(column.tobytes() for column in columns) if memory.made else None
    if noted is None or noted != memory.noted:  # most are resources and finished structures, the same as the last time
        _note(memory, columns)
        in_sight = set(world.tag.take(slots[visible]).tolist())
        _cover(world, memory, [s for s in memory.of_unit.values() if s.unit not in in_sight])
        memory.noted = noted
    uncovered = world.visibility[player].take(memory.cells) == VISIBLE
    if some(uncovered):
        for index in which(uncovered).tolist():
            del memory.of_unit[memory.shown[index].unit]
        _cover(world, memory, [s for s in memory.shown if s.unit in memory.of_unit])


def _cover(world: World, memory: FogMemory, hidden: list[RememberedUnit]) -> None:
    """Write which snapshots the fog covers."""
    width = world.map.terrain.size[0]
    memory.shown = hidden
    memory.cells = np.array([int(s.pos[1]) * width + int(s.pos[0]) for s in hidden], dtype=np.int64)


def _note(memory: FogMemory, columns: list[NDArray[Any]]) -> None:
    """Remember units as they are now: tag, type, owner, place, heading and progress."""
    for tag, row, owner, (x, y), (hx, hy), progress in zip(*(c.tolist() for c in columns), strict=True):
        known, now = memory.of_unit.get(tag), (row, owner, (x, y), (hx, hy), progress)
        if known is not None and now == (known.row, known.owner, known.pos, known.heading, known.build_progress):
            continue
        if known is None:
            memory.made += 1
        own_tag = TAG_BASE | memory.made << INDEX_SHIFT if known is None else known.tag
        memory.of_unit[tag] = RememberedUnit(own_tag, tag, *now)


@lru_cache(maxsize=4)
def leave_snapshots(catalog: Catalog) -> NDArray[np.bool_]:
    """Return [rows] which types leave snapshots: structures, resources and all others that never move."""
    return np.array([(u.structure or bool(u.resource)) and u.speed_n == 0.0 for u in catalog.units])
