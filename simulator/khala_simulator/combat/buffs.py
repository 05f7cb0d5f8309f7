"""Buffs: apply one to a unit and remove it again.

``buff_kinds`` says what each kind changes, ``active_buffs`` holds the ones in force. ``traits`` writes the changes into
the trait columns when a buff comes or goes, not in every loop; ``systems.buffs`` removes those that run out. The
abilities decide who applies one to which unit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.combat.traits import refresh
from khala_simulator.world.active_buffs import FOREVER
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.world import World

FRENZIED: Final = frozenset({"Ultralisk", "UltraliskBurrowed"})
"""Types that the catalog gives the behaviour Frenzy."""


def apply(
    world: World, slot: int, name: str, *, source: int = NOBODY, owner: int | None = None, loops: float | None = None
) -> None:
    """Apply a buff to a unit, or restart its time if the unit already has one of the kind.

    Args:
        world: The game.
        slot: The unit that gets it; a unit has each kind only once, but kinds that stack count.
        name: Its name in the catalog.
        source: Slot of the unit that casts it.
        owner: The owner of that unit, the source's owner by default.
        loops: How long it lasts, as the catalog says by default; 0 is without an end.
    """
    buff = world.catalog.buff(name)
    if "spares_frenzied" in buff.flags and is_frenzied(world, slot):
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
    table.add((slot, buff.row, source, owner, world.loop, end, due, 1))
    refresh(world, slot)


def is_frenzied(world: World, slot: int) -> bool:
    """Return whether a unit can't be slowed, moved or taken over: an Ultralisk."""
    return world.unit_type(slot).name in FRENZIED


def remove(world: World, slot: int, name: str) -> bool:
    """Remove a buff from a unit; return whether it had one."""
    row = world.catalog.buff(name).row
    rows = world.buffs.rows
    mine = (rows["slot"] == slot) & (rows["buff"] == row)
    if not mine.any():
        return False
    world.buffs.keep(~mine)
    refresh(world, slot)
    return True


def has(world: World, slot: int, name: str) -> bool:
    """Return whether a unit has a buff."""
    return len(world.buffs) > 0 and world.buffs.find(slot, world.catalog.buff(name).row) >= 0
