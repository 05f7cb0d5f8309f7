"""Fog: what a player remembers of structures and resources where it sees nothing now.

Keeps the snapshots of ``World.memories`` up to date. Above: ``systems.vision``. Below: ``snapshots``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.native import columns, memory
from khala_simulator.world.columns import INDEX_SHIFT
from khala_simulator.world.players import NEUTRAL
from khala_simulator.world.snapshots import TAG_BASE, RememberedUnit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Floats, Ints
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
    c = columns.columns_of(world)
    known = world.memories[player]
    first = not known.made  # the game shows where the neutral things are from the start
    leave = leave_snapshots(world.catalog)
    leaves = memory.bools(leave)
    live = world.live
    slots = memory.ints(live)
    found = memory.new_ints(len(live))
    seen = memory.ints(found)
    n = 0
    for i in range(len(live)):
        slot = slots[i]
        if not leaves[c.type[slot]] or c.owner[slot] == player:
            continue
        if c.visible[player * c.capacity + slot] or (first and c.owner[slot] == NEUTRAL):
            seen[n] = slot
            n += 1
    if known.noted is None or not _is_noted(c, seen, n, known.noted):  # most are the same as the last time
        _note(c, known, seen, n)
        in_sight = {c.tag[seen[i]] for i in range(n) if c.visible[player * c.capacity + seen[i]]}
        _cover(world, known, [s for s in known.of_unit.values() if s.unit not in in_sight])
        known.noted = None if first else _numbers(c, seen, n)
    _uncover(world, player, known)


def _uncover(world: World, player: int, known: FogMemory) -> None:
    """Forget the snapshots whose place is seen without the unit."""
    cells = memory.ints(known.cells)
    visibility = memory.uint8s(world.visibility[player])
    gone = [i for i in range(len(known.cells)) if visibility[cells[i]] == VISIBLE]
    if gone:
        for i in gone:
            del known.of_unit[known.shown[i].unit]
        _cover(world, known, [s for s in known.shown if s.unit in known.of_unit])


def _cover(world: World, known: FogMemory, hidden: list[RememberedUnit]) -> None:
    """Write which snapshots the fog covers."""
    width = world.map.terrain.size[0]
    known.shown = hidden
    known.cells = np.array([int(s.pos[1]) * width + int(s.pos[0]) for s in hidden], dtype=np.int64)


def _note(c: Columns, known: FogMemory, slots: Cells, n: int) -> None:
    """Remember units as they are now."""
    for i in range(n):
        slot = slots[i]
        pos = c.pos[slot]
        heading = c.heading[slot]
        tag = c.tag[slot]
        now = (c.type[slot], c.owner[slot], (pos.x, pos.y), (heading.x, heading.y), c.build_progress[slot])
        then = known.of_unit.get(tag)
        if then is not None and now == (then.row, then.owner, then.pos, then.heading, then.build_progress):
            continue
        if then is None:
            known.made += 1
        own_tag = TAG_BASE | known.made << INDEX_SHIFT if then is None else then.tag
        known.of_unit[tag] = RememberedUnit(own_tag, tag, *now)


def _numbers(c: Columns, slots: Cells, n: int) -> tuple[Ints, Floats]:
    """Return the tag, type and owner of each unit, and its place, heading and progress."""
    names = memory.new_ints(3 * n)
    states = memory.new_floats(5 * n)
    name = memory.ints(names)
    state = memory.floats(states)
    for i in range(n):
        slot = slots[i]
        name[3 * i] = c.tag[slot]
        name[3 * i + 1] = c.type[slot]
        name[3 * i + 2] = c.owner[slot]
        state[5 * i] = c.pos[slot].x
        state[5 * i + 1] = c.pos[slot].y
        state[5 * i + 2] = c.heading[slot].x
        state[5 * i + 3] = c.heading[slot].y
        state[5 * i + 4] = c.build_progress[slot]
    return names, states


def _is_noted(c: Columns, slots: Cells, n: int, noted: tuple[Ints, Floats]) -> bool:
    """Return whether units are as they were noted."""
    names, states = noted
    if len(names) != 3 * n:
        return False
    name = memory.ints(names)
    state = memory.floats(states)
    for i in range(n):
        slot = slots[i]
        if name[3 * i] != c.tag[slot] or name[3 * i + 1] != c.type[slot] or name[3 * i + 2] != c.owner[slot]:
            return False
        if state[5 * i] != c.pos[slot].x or state[5 * i + 1] != c.pos[slot].y:
            return False
        if state[5 * i + 2] != c.heading[slot].x or state[5 * i + 3] != c.heading[slot].y:
            return False
        if state[5 * i + 4] != c.build_progress[slot]:
            return False
    return True


@lru_cache(maxsize=4)
def leave_snapshots(catalog: Catalog) -> NDArray[np.bool_]:
    """Return [rows] which types leave snapshots: structures, resources and all others that never move."""
    return np.array([(u.structure or bool(u.resource)) and u.speed_n == 0.0 for u in catalog.units])
