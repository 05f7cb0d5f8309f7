"""Movement: steps towards the next corner, acceleration, turning, and detours around bodies.

Moves everybody as if alone; ``collision`` then pushes bodies apart and off the walls and tells who was blocked.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from simulator import geometry
from simulator.world import NOBODY

if TYPE_CHECKING:
    from simulator.geometry import Floats
    from simulator.world import Ints, World

DETOUR_COS = math.cos(math.radians(70.0))
DETOUR_SIN = math.sin(math.radians(70.0))


def move(world: World) -> None:
    """Walk one loop and turn; writes ``pos``, ``speed``, ``heading`` and this loop's ``intended`` step."""
    n = world.top
    world.intended[:n] = 0.0
    walkers = np.flatnonzero(world.wants[:n])
    if walkers.size:
        _walk(world, walkers)
    standing = world.speed[:n] > 0.0
    standing[walkers] = False
    world.speed[:n][standing] = 0.0
    _face_targets(world)


def _walk(world: World, walkers: Ints) -> None:
    pos = world.pos[walkers]
    offset = world.nav_point[walkers] - pos
    distance = geometry.length(offset)
    direction = offset / np.maximum(distance, 1e-12)[:, None]
    straight = world.nav_straight[walkers]
    left = np.where(straight, np.maximum(distance - world.stop_at[walkers], 0.0), distance)
    speed = np.minimum(world.speed[walkers] + world.step_gain[walkers], _top_speed(world, walkers, pos))
    step = np.minimum(speed, left)
    direction = _turned_aside(world, walkers, direction)
    world.speed[walkers] = speed
    world.intended[walkers] = direction * step[:, None]
    moving = step > 0.0
    facing = geometry.turn_towards(world.heading[walkers], direction, world.turn_cos[walkers], world.turn_sin[walkers])
    world.heading[walkers[moving]] = facing[moving]


def _top_speed(world: World, walkers: Ints, pos: Floats) -> Floats:
    speed = world.step_max[walkers]
    if world.creep_counts:
        width, height = world.map.terrain.size
        x = np.clip(pos[:, 0].astype(np.int64), 0, width - 1)
        y = np.clip(pos[:, 1].astype(np.int64), 0, height - 1)
        speed = np.where(world.map.terrain.creep[y, x], speed * world.creep_factor[walkers], speed)
    return speed


def _turned_aside(world: World, walkers: Ints, direction: Floats) -> Floats:
    """Directions of walkers on a detour, turned to their side."""
    side = world.detour[walkers]
    if not side.any():
        return direction
    over = (side != 0) & (world.detour_loop[walkers] <= world.loop)
    world.detour[walkers[over]] = 0
    side = np.where(over, 0, side)
    aside = np.empty_like(direction)
    aside[:, 0] = direction[:, 0] * DETOUR_COS - direction[:, 1] * DETOUR_SIN * side
    aside[:, 1] = direction[:, 1] * DETOUR_COS + direction[:, 0] * DETOUR_SIN * side
    return np.where((side != 0)[:, None], aside, direction)


def _face_targets(world: World) -> None:
    """Turn those who stand and fight towards their target; what can't turn keeps its heading."""
    n = world.top
    turning = np.flatnonzero((world.target[:n] != NOBODY) & ~world.wants[:n] & (world.aim_cos[:n] > -1.0))
    if not turning.size:
        return
    offset = world.pos[world.target[turning]] - world.pos[turning]
    wanted = offset / np.maximum(geometry.length(offset), 1e-12)[:, None]
    world.heading[turning] = geometry.turn_towards(
        world.heading[turning], wanted, world.turn_cos[turning], world.turn_sin[turning]
    )
