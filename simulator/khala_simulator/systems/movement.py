"""Movement: steps towards the next corner, along the headings of ``avoidance``; acceleration, braking and turning.

Every unit steps as if alone; ``collision`` then carries the steps out, pushes bodies apart and off the walls, and notes
blocked units. A unit that needs time to stop brakes in time to stand exactly on its goal, and a flyer that no longer
wants to go anywhere coasts to a stop. A ground unit has to face its way to make headway, a flyer flies where it is
facing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some, which
from khala_simulator.world.census import census

if TYPE_CHECKING:
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.columns import Bools, Ints
    from khala_simulator.world.world import World

NOBODY_COASTS: Ints = np.zeros(0, dtype=np.int64)
TURNING_CIRCLES = 4.0  # a flyer this many steps from its goal no longer swings around


def move(world: World) -> None:
    """Choose this loop's steps and turn; writes ``intended``, ``speed`` and ``heading``."""
    n = world.top
    wants = world.wants[:n]
    coasting = _coasting(world)
    if some(wants) or coasting.size:
        drift = _drift(world, coasting) if coasting.size else None
        world.speed[:n] *= wants
        world.intended[:n] = 0.0
        if drift is not None:
            world.intended[coasting] = drift
            world.speed[coasting] = geometry.length(drift)
        walkers = which(wants)
        if walkers.size:
            _walk(world, walkers)
        world.anyone_moved = True
    elif world.anyone_moved:
        world.speed[:n] = 0.0
        world.intended[:n] = 0.0
        world.anyone_moved = False
    _face_targets(world)


def _face_targets(world: World) -> None:
    """Turn units that stand and fight to their target; turrets and units that can't turn keep the body's heading."""
    fighters = world.fighters
    turning = world.aim_cos.take(fighters) > -1.0
    turning &= ~world.turreted.take(fighters)
    turning &= ~world.wants.take(fighters)
    slots = fighters[turning]
    if not slots.size:
        return
    facing, wanted = world.heading.take(slots, 0), world.toward.take(slots, 0)
    if np.count_nonzero(facing != wanted):
        world.heading[slots] = geometry.turn_towards(
            facing,
            wanted,
            world.turn_still_cos.take(slots),
            world.turn_still_sin.take(slots),
        )


# flyers that stop -----------------------------------------------------------------------------------------------------


def _coasting(world: World) -> Ints:
    """Return flyers that have speed left and nowhere to go."""
    if not census(world).drifting_flyers:
        return NOBODY_COASTS
    n = world.top
    left = (world.speed[:n] > 0.0) & ~world.wants[:n]
    if some(left):
        left &= world.glides[:n]
        left &= world.step_max[:n] > 0.0
    return which(left)


def _drift(world: World, slots: Ints) -> Floats:
    """Return (k, 2) their steps of this loop: as the last one, a little shorter."""
    last = world.intended.take(slots, 0)
    speed = np.maximum(world.speed.take(slots) - world.step_loss.take(slots), 0.0)
    drift: Floats = last * (speed / np.maximum(geometry.length(last), 1e-12))[:, None]
    return drift


# walkers --------------------------------------------------------------------------------------------------------------


def _walk(world: World, walkers: Ints) -> None:
    """Choose the steps of all walkers, and turn them."""
    pos = world.pos.take(walkers, 0)
    offset = world.nav_point.take(walkers, 0) - pos
    distance = geometry.length(offset)
    direction = offset / np.maximum(distance, 1e-12)[:, None]
    straight = world.nav_straight.take(walkers)
    left = np.maximum(distance - world.stop_at.take(walkers) * straight, 0.0)
    speed = np.minimum(world.speed.take(walkers) + world.step_gain.take(walkers), _top_speed(world, walkers, pos))
    speed = _braked(world, walkers, speed, left, straight)
    aside = world.aside.take(walkers, 0)
    if np.count_nonzero(aside):
        turned: Bools = (aside[:, 0] != 0.0) | (aside[:, 1] != 0.0)
        turned &= world.detour.take(walkers) != 0
        direction = np.where(turned[:, None], aside, direction)
    step = np.minimum(speed, left)
    moving = step > 0.0
    if np.count_nonzero(moving) < len(moving):
        direction = np.where(moving[:, None], direction, world.heading.take(walkers, 0))
    step, way = _turn(world, walkers, direction, step, left)
    world.speed[walkers] = speed
    world.intended[walkers] = way * step[:, None]


def _braked(world: World, walkers: Ints, speed: Floats, left: Floats, straight: Bools) -> Floats:
    """Return the speeds at which each walker can still stop at its goal; one with a further order does not stop."""
    if not census(world).brakers:
        return speed
    loss = world.step_loss.take(walkers)
    braking = np.isfinite(loss) & straight
    if not some(braking):
        return speed
    loss = np.where(braking, loss, 0.0)
    least = np.sqrt(2.0 * loss * left + 0.25 * loss * loss) - 0.5 * loss
    braking &= least < speed
    for i in which(braking).tolist():
        braking[i] = not world.queue[walkers[i]]
    return np.where(braking, least, speed)


def _turn(world: World, walkers: Ints, wanted: Floats, step: Floats, left: Floats) -> tuple[Floats, Floats]:
    """Turn walkers to the wanted directions (k, 2); return how far and which way they move meanwhile."""
    facing = world.heading.take(walkers, 0)
    product = facing * wanted
    error_cos = product[:, 0] + product[:, 1]
    turn_cos, turn_sin = world.turn_cos.take(walkers), world.turn_sin.take(walkers)
    late = error_cos < turn_cos
    if not some(late):
        world.heading[walkers] = wanted
        return step, wanted
    standing = (world.speed.take(walkers) <= 0.0) | (error_cos < 0.0)
    turn_cos = np.where(standing, world.turn_still_cos.take(walkers), turn_cos)
    turn_sin = np.where(standing, world.turn_still_sin.take(walkers), turn_sin)
    facing = geometry.turn_towards(facing, wanted, turn_cos, turn_sin)
    world.heading[walkers] = facing
    product = facing * wanted
    swings = world.glides.take(walkers)
    swings &= left > TURNING_CIRCLES * step
    step = np.where(swings | ~late, step, step * np.maximum(product[:, 0] + product[:, 1], 0.0))
    return step, np.where(swings[:, None], facing, wanted)


def _top_speed(world: World, walkers: Ints, pos: Floats) -> Floats:
    speed = world.step_max.take(walkers)
    if world.growth.anywhere:
        width, height = world.map.terrain.size
        at = np.minimum(np.maximum(pos.astype(np.int64), 0), (width - 1, height - 1))
        on_creep = world.creep.take(at[:, 1] * width + at[:, 0])
        speed = np.where(on_creep, speed * world.creep_factor.take(walkers), speed)
    return speed
