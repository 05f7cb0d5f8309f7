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
    slots, wanted = _fighting_on_the_spot(world)
    if some(wants):
        world.speed[:n] *= wants
        world.intended[:n] = 0.0
        walkers = which(wants)
        direction = _walk(world, walkers)
        slots, wanted = np.concatenate((walkers, slots)), np.concatenate((direction, wanted))
        world.stirred = True
    elif world.stirred:
        world.speed[:n] = 0.0
        world.intended[:n] = 0.0
        world.stirred = False
    if slots.size:
        world.heading[slots] = geometry.turn_towards(
            world.heading.take(slots, 0), wanted, world.turn_cos.take(slots), world.turn_sin.take(slots)
        )


def _fighting_on_the_spot(world: World) -> tuple[Ints, Floats]:
    """Those who stand and fight, with the direction of their target; what can't turn keeps its heading."""
    fighters = world.fighters
    turning = world.aim_cos.take(fighters) > -1.0
    turning &= ~world.turreted.take(fighters)
    turning &= ~world.wants.take(fighters)
    slots = fighters[turning]
    return slots, world.toward.take(slots, 0)


def _walk(world: World, walkers: Ints) -> Floats:
    """Choose the steps of all who walk; returns the directions (k, 2) to turn to."""
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
    moving = step > 0.0
    if np.count_nonzero(moving) < len(moving):
        direction = np.where(moving[:, None], direction, world.heading.take(walkers, 0))
    return direction


def _top_speed(world: World, walkers: Ints, pos: Floats) -> Floats:
    speed = world.step_max.take(walkers)
    if world.creep_counts:
        width, height = world.map.terrain.size
        x = np.clip(pos[:, 0].astype(np.int64), 0, width - 1)
        y = np.clip(pos[:, 1].astype(np.int64), 0, height - 1)
        speed = np.where(world.map.terrain.creep[y, x], speed * world.creep_factor.take(walkers), speed)
    return speed
