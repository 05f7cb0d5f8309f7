"""Hits: the hits of a fired weapon happen when they are due, at once, as a missile or as a sweep.

Between ``weapons``, which puts hits into ``pending`` at the damage point, and the rules that carry them out:
``damage``, ``missiles``, ``sweeps``. Hits happen in the order in which they are due and were fired; those of a dead
attacker are lost.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.combat import damage
from khala_simulator.numeric.arrays import some
from khala_simulator.systems import missiles, sweeps
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import shots_of

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def fall_due(world: World) -> None:
    """Carry out every hit that is due."""
    pending = world.pending
    if not len(pending):
        return
    due = pending.rows["due"] <= world.loop
    if not some(due):
        return
    homing = (pending.target != NOBODY) & ~world.stats.kamikaze[pending.rows["weapon"]]
    pending.rows["goal"] = np.where(homing[:, None], world.pos.take(pending.target, 0), pending.goal)
    rows = pending.rows[due]
    pending.keep(~due)
    for shot, begun, single in zip(shots_of(rows), rows["due"].tolist(), rows["single"].tolist(), strict=True):
        if shot.source == NOBODY:
            continue
        hit = world.catalog.weapons[shot.weapon].hits[shot.hit]
        if single:
            damage.hit_target(world, shot)
        elif hit.missile_speed_n is not None:
            missiles.launch(world, shot, hit)
        elif hit.sweep is not None:
            sweeps.begin(world, shot, begun)
        else:
            damage.hit_with(world, shot)
