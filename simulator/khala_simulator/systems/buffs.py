"""Buffs: their periods come and their time runs out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.abilities.registry import ENDS, TICKS
from khala_simulator.combat.traits import refresh
from khala_simulator.numeric.arrays import some, which

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def run_out(world: World) -> None:
    """Run the rules of buffs that are due, and remove those whose time is over."""
    if not world.buffs.any_due(world.loop):
        return
    _tick(world)
    over = world.buffs.rows["end"] <= world.loop
    if not some(over):
        return
    ended = world.buffs.rows[over]
    world.buffs.keep(~over)
    for row in ended:
        slot = int(row["slot"])
        refresh(world, slot)
        rule = ENDS.get(world.catalog.buffs[int(row["buff"])].name)
        if rule is not None:
            rule(world, slot, row)


def _tick(world: World) -> None:
    """Run the rules of buffs whose period has come; a buff that another rule removes meanwhile does nothing more."""
    due = which(world.buffs.rows["due"] <= world.loop)
    for row in world.buffs.rows[due]:
        slot = int(row["slot"])
        kind = world.catalog.buffs[int(row["buff"])]
        index = world.buffs.find(slot, kind.row)
        if index < 0:
            continue
        world.buffs.rows[index]["due"] += kind.period_loops
        rule = TICKS.get(kind.name)
        if rule is not None:
            rule(world, slot, world.buffs.rows[index].copy())
