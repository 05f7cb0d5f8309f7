"""Movement: steps towards the next corner, along the headings of ``avoidance``, acceleration and turning.

Everybody steps as if alone; ``collision`` then carries the steps out, pushes bodies apart and off the walls, and
notes who was blocked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator import geometry
from simulator.arrays import some, which

if TYPE_CHECKING:
    from simulator.columns import Bools, Ints
    from simulator.geometry import Floats
    from simulator.world import World


def move(world: World) -> None:
    """Choose this loop's steps and turn; writes ``intended``, ``speed`` and ``heading``."""
    n = world.top
    wants = world.wants[:n]
    if some(wants):
        world.speed[:n] *= wants
        world.intended[:n] = 0.0
        _walk(world, which(wants))
        world.stirred = True
    elif world.stirred:
        world.speed[:n] = 0.0
        world.intended[:n] = 0.0
        world.stirred = False
    _face_targets(world)


def _walk(world: World, walkers: Ints) -> None:
    pos = world.pos.take(walkers, 0)
    offset = world.nav_point.take(walkers, 0) - pos
    distance = geometry.length(offset)
    direction = offset / np.maximum(distance, 1e-12)[:, None]
    speed = np.minimum(world.speed.take(walkers) + world.step_gain.take(walkers), _top_speed(world, walkers, pos))
    left = distance - world.stop_at.take(walkers) * world.nav_straight.take(walkers)
    step = np.minimum(speed, np.maximum(left, 0.0))
    aside = world.aside.take(walkers, 0)
    if np.count_nonzero(aside):
        turned: Bools = (aside[:, 0] != 0.0) | (aside[:, 1] != 0.0)
        turned &= world.detour.take(walkers) != 0
        direction = np.where(turned[:, None], aside, direction)
    world.speed[walkers] = speed
    world.intended[walkers] = direction * step[:, None]
    facing = world.heading.take(walkers, 0)
    moving = step > 0.0
    if np.count_nonzero(moving) < len(moving):
        direction = np.where(moving[:, None], direction, facing)
    world.heading[walkers] = geometry.turn_towards(
        facing, direction, world.turn_cos.take(walkers), world.turn_sin.take(walkers)
    )


def _top_speed(world: World, walkers: Ints, pos: Floats) -> Floats:
    speed = world.step_max.take(walkers)
    if world.creep_counts:
        width, height = world.map.terrain.size
        x = np.clip(pos[:, 0].astype(np.int64), 0, width - 1)
        y = np.clip(pos[:, 1].astype(np.int64), 0, height - 1)
        speed = np.where(world.map.terrain.creep[y, x], speed * world.creep_factor.take(walkers), speed)
    return speed


def _face_targets(world: World) -> None:
    """Turn those who stand and fight towards their target; what can't turn keeps its heading."""
    fighters = world.fighters
    if not fighters.size:
        return
    turning = (world.aim_cos.take(fighters) > -1.0) & ~world.wants.take(fighters)
    if not some(turning):
        return
    slots = fighters[turning]
    heading, wanted = world.heading.take(slots, 0), world.toward.take(slots, 0)
    turned = geometry.turn_towards(heading, wanted, world.turn_cos.take(slots), world.turn_sin.take(slots))
    world.heading[slots] = turned
