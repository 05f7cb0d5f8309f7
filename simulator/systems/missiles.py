"""Missiles: they follow their target and hit when they reach its edge, or the last place of a target that died."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator import geometry
from simulator.arrays import some, which
from simulator.columns import NOBODY
from simulator.systems import damage

if TYPE_CHECKING:
    from simulator.world import World


def fly(world: World) -> None:
    """Move all missiles by one loop and let those that arrive hit."""
    missiles = world.missiles
    if not len(missiles):
        return
    shots = missiles.rows
    target = shots["target"]
    homing = target != NOBODY
    body = world.radius.take(target) * homing
    shots["goal"] = np.where(homing[:, None], world.pos.take(target, 0), shots["goal"])
    step = shots["step"] = np.minimum(shots["step"] + shots["gain"], shots["top"])
    offset = shots["goal"] - shots["pos"]
    distance = geometry.length(offset)
    arriving = distance - body <= step
    shots["pos"] += offset * (step / np.maximum(distance, 1e-12))[:, None]
    if some(arriving):
        for shot in which(arriving).tolist():
            damage.hit_with(world, damage.shot_of(shots[shot]))
        missiles.keep(~arriving)
