"""Buffs: how one is laid on a unit and taken off it again.

``buff_kinds`` says what each kind changes, ``active_buffs`` holds the ones in force. What they change is written into
the trait columns by ``traits``, when a buff comes or goes and not in every loop; ``systems.buffs`` lets them run out.
Who lays one on which unit is for the abilities to say.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat.traits import refresh
from khala_simulator.world.active_buffs import FOREVER, ROW
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.world import World

FRENZIED: Final = frozenset({"Ultralisk", "UltraliskBurrowed"})
"""Types that the catalog gives the behaviour Frenzy."""


def apply(
    world: World, slot: int, name: str, *, source: int = NOBODY, owner: int | None = None, loops: float | None = None
) -> None:
    """Lay a buff on a unit, or begin its time anew when it bears one of the kind already.

    Args:
        world: The game.
        slot: Who is to bear it; nobody bears one twice, but kinds that stack count.
        name: Its name in the catalog.
        source: Slot of the unit that casts it.
        owner: Whose unit that is, the source's owner by default.
        loops: How long it lasts, as the catalog says by default; 0 is without an end.
    """
    buff = world.catalog.buff(name)
    if "spares_frenzied" in buff.flags and frenzied(world, slot):
        return
    lasts = buff.loops if loops is None else loops
    end = world.loop + lasts if lasts else FOREVER
    if owner is None:
        owner = int(world.owner[source]) if source != NOBODY else int(world.owner[slot])
    table = world.buffs
    at = table.find(slot, buff.row)
    if at >= 0:
        row = table.rows[at]
        row["end"], row["source"], row["owner"] = max(float(row["end"]), end), source, owner
        row["count"] = min(int(row["count"]) + 1, buff.stacks)
        return
    due = world.loop + buff.period_loops if buff.period_loops else FOREVER
    fresh = np.array([(slot, buff.row, source, owner, world.loop, end, due, 1)], dtype=ROW)
    table.rows = np.concatenate((table.rows, fresh))
    refresh(world, slot)


def frenzied(world: World, slot: int) -> bool:
    """Whether a unit can be neither slowed nor moved nor taken over: an Ultralisk."""
    return world.unit_type(slot).name in FRENZIED


def remove(world: World, slot: int, name: str) -> bool:
    """Take a buff off a unit; returns whether it bore one."""
    row = world.catalog.buff(name).row
    rows = world.buffs.rows
    mine = (rows["slot"] == slot) & (rows["buff"] == row)
    if not mine.any():
        return False
    world.buffs.rows = rows[~mine]
    refresh(world, slot)
    return True


def has(world: World, slot: int, name: str) -> bool:
    """Whether a unit bears a buff."""
    return len(world.buffs) > 0 and world.buffs.find(slot, world.catalog.buff(name).row) >= 0
