"""Missiles: they follow their target and hit when they reach its edge, or the last place of a target that died.

A missile that bounces goes on from its victim to the next enemy near it that it has not hit yet.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.combat import damage
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.stats import INSTANT_ACCELERATION_N
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import Shot, shots_of

if TYPE_CHECKING:
    from khala_simulator.tables.records import Hit
    from khala_simulator.world.world import World


def fly(world: World) -> None:
    """Move all missiles by one loop and carry out the hits of those that arrive."""
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
        arrived = shots_of(shots[arriving])
        missiles.keep(~arriving)
        for shot in arrived:
            damage.hit_with(world, shot)
            bounce(world, shot)


def launch(world: World, shot: Shot, hit: Hit) -> None:
    """Send the missile of a hit on its way."""
    step, top, gain = speeds(hit)
    world.missiles.append(1, **shot._asdict(), pos=shot.start, step=step, top=top, gain=gain)


def speeds(hit: Hit) -> tuple[float, float, float]:
    """Return the first and the highest speed of a hit's missile, and its acceleration, in world units and loops."""
    top = (hit.missile_speed_n or 0.0) / LOOPS_PER_NORMAL_SECOND
    gain_n = hit.missile_acceleration_n
    if gain_n is None or gain_n >= INSTANT_ACCELERATION_N:
        return top, top, math.inf
    return 0.0, top, gain_n / LOOPS_PER_NORMAL_SECOND**2


def bounce(world: World, shot: Shot) -> None:
    """Send on a missile that bounces; one whose target died on the way is lost."""
    hits = world.catalog.weapons[shot.weapon].hits
    if shot.target == NOBODY or shot.hit + 1 >= len(hits) or not hits[shot.hit + 1].bounce:
        return
    onward = hits[shot.hit + 1]
    if onward.search is None:
        return
    for slot in damage.found_by(world, onward.search, shot):
        x, y = world.pos[slot].tolist()
        after = shot._replace(target=slot, prior=shot.target, hit=shot.hit + 1, start=shot.goal, goal=(x, y))
        launch(world, after, onward)
