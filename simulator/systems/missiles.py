"""Missiles: they follow their target and hit when they reach its edge, or the last place of a target that died."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator import geometry
from simulator.systems import damage
from simulator.world import NOBODY

if TYPE_CHECKING:
    from simulator.world import World


def fly(world: World) -> None:
    """Move all missiles by one loop and let those that arrive hit."""
    missiles = world.missiles
    if not len(missiles):
        return
    homing = missiles.target != NOBODY
    missiles.goal[homing] = world.pos[missiles.target[homing]]
    body = np.where(homing, world.radius[missiles.target], 0.0)
    missiles.step = np.minimum(missiles.step + missiles.step_gain, missiles.step_max)
    offset = missiles.goal - missiles.pos
    distance = geometry.length(offset)
    arriving = distance - body <= missiles.step
    share = np.where(arriving, 1.0, missiles.step / np.maximum(distance, 1e-12))
    missiles.pos = missiles.pos + offset * share[:, None]
    if arriving.any():
        for shot in np.flatnonzero(arriving).tolist():
            damage.hit_with(world, missiles, shot)
        missiles.keep(~arriving)
