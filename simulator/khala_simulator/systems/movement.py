"""Movement: steps towards the next corner, along the headings of ``avoidance``; acceleration, braking and turning.

Every unit steps as if alone; ``collision`` then carries the steps out, pushes bodies apart and off the walls, and notes
blocked units. A unit that needs time to stop brakes in time to stand exactly on its goal, and a flyer that no longer
wants to go anywhere coasts to a stop. A ground unit has to face its way to make headway, a flyer flies where it is
facing.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala_simulator.combat import census
from khala_simulator.movement import turning
from khala_simulator.native import columns, memory

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

TURNING_CIRCLES: Final = 4.0  # a flyer this many steps from its goal no longer swings around
NO_DISTANCE: Final = 1e-12
NO_CREEP: Final = np.zeros(0, dtype=np.bool_)


def move(world: World) -> None:
    """Choose this loop's steps and turn; writes ``intended``, ``speed`` and ``heading``."""
    c = columns.columns_of(world)
    n = world.top
    kinds = census.census(world)
    drifts = kinds.drifting_flyers
    walking = 0
    anyone = False
    for slot in range(n):
        if c.wants[slot]:
            walking += 1
        elif drifts and _coasts(c, slot):
            anyone = True
    if anyone or walking or world.anyone_moved:
        for slot in range(n):
            if c.wants[slot]:
                continue
            if drifts and _coasts(c, slot):
                _drift(c, slot)
            else:
                c.speed[slot] = 0.0
                c.intended[slot] = memory.point(0.0, 0.0)
        if walking:
            _walk(world, c, walking, kinds.brakers)
        world.anyone_moved = anyone or walking > 0
    _face_targets(world, c)


def _face_targets(world: World, c: Columns) -> None:
    """Turn units that stand and fight to their target; turrets and units that can't turn keep the body's heading."""
    fighters = world.fighters
    slots = memory.ints(fighters)
    for i in range(len(fighters)):
        slot = slots[i]
        if c.aim_cos[slot] > -1.0 and not c.turreted[slot] and not c.wants[slot]:
            c.heading[slot] = turning.turn(
                c.heading[slot], c.toward[slot], c.turn_still_cos[slot], c.turn_still_sin[slot]
            )


# flyers that stop -----------------------------------------------------------------------------------------------------


def _coasts(c: Columns, slot: int) -> bool:
    """Return whether a flyer has speed left and nowhere to go."""
    return c.glides[slot] and c.speed[slot] > 0.0 and not c.wants[slot] and c.step_max[slot] > 0.0


def _drift(c: Columns, slot: int) -> None:
    """Write the step of a flyer that coasts: as its last one, a little shorter."""
    last = c.intended[slot]
    share = max(c.speed[slot] - c.step_loss[slot], 0.0) / max(memory.length(last.x, last.y), NO_DISTANCE)
    step = memory.point(last.x * share, last.y * share)
    c.intended[slot] = step
    c.speed[slot] = memory.length(step.x, step.y)


# walkers --------------------------------------------------------------------------------------------------------------


class _Walks:
    """The steps of all walkers; the i-th of each column belongs to the i-th walker."""

    def __init__(self, walkers: int) -> None:
        self.room = walkers
        self.arrays = (
            memory.new_ints(walkers),
            memory.new_points(walkers),
            memory.new_floats(walkers),
            memory.new_floats(walkers),
            memory.new_floats(walkers),
            memory.new_floats(walkers),
        )
        self.slot = memory.ints(self.arrays[0])
        self.way = memory.points(self.arrays[1])  # unit vectors
        self.speed = memory.floats(self.arrays[2])
        self.step = memory.floats(self.arrays[3])
        self.left = memory.floats(self.arrays[4])  # to the corner or the goal
        self.error_cos = memory.floats(self.arrays[5])  # between the heading and that way

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Return what makes None: a copy of a world takes its own."""
        return type(None), ()


def _walks_of(world: World, walking: int) -> _Walks:
    """Return room for the steps of so many walkers."""
    walks: _Walks | None = world.steps  # type: ignore[assignment]  # its fields say less
    if walks is None or walks.room < walking:
        walks = world.steps = _Walks(2 * walking)
    return walks


def _walk(world: World, c: Columns, walking: int, brakers: bool) -> None:
    """Choose the steps of all walkers, and turn them."""
    walks = _walks_of(world, walking)
    queue = world.queue
    creeps = world.growth.anywhere
    covered = NO_CREEP
    width = height = 0
    if creeps:
        covered = np.ascontiguousarray(world.creep)
        width, height = world.map.terrain.size
    creep = memory.bools(covered)
    late = False
    i = 0
    for slot in range(world.top):
        if c.wants[slot]:
            walks.slot[i] = slot
            top_speed = c.step_max[slot]
            if creeps and creep[_cell(c.pos[slot], width, height)]:
                top_speed = top_speed * c.creep_factor[slot]
            _choose(c, walks, i, top_speed, brakers, queue)
            walks.error_cos[i] = c.heading[slot].x * walks.way[i].x + c.heading[slot].y * walks.way[i].y
            if walks.error_cos[i] < c.turn_cos[slot]:
                late = True
            i += 1
    for i in range(walking):
        slot = walks.slot[i]
        if late:
            _turn(c, walks, i)
        else:
            c.heading[slot] = walks.way[i]
        c.speed[slot] = walks.speed[i]
        c.intended[slot] = memory.point(walks.way[i].x * walks.step[i], walks.way[i].y * walks.step[i])


def _cell(at: memory.Point, width: int, height: int) -> int:
    """Return the cell of the map under a point, the nearest one if it is outside."""
    column = int(at.x)
    row = int(at.y)
    return min(max(row, 0), height - 1) * width + min(max(column, 0), width - 1)


def _choose(c: Columns, walks: _Walks, i: int, top_speed: float, brakers: bool, queue: list[Any]) -> None:
    """Choose the way and the step of a walker of some top speed."""
    slot = walks.slot[i]
    x = c.nav_point[slot].x - c.pos[slot].x
    y = c.nav_point[slot].y - c.pos[slot].y
    distance = memory.length(x, y)
    left = max(distance - c.stop_at[slot] * c.nav_straight[slot], 0.0)
    speed = min(c.speed[slot] + c.step_gain[slot], top_speed)
    if brakers and c.nav_straight[slot] and math.isfinite(c.step_loss[slot]):
        loss = c.step_loss[slot]
        slowest = math.sqrt(2.0 * loss * left + 0.25 * loss * loss) - 0.5 * loss
        if slowest < speed and not queue[slot]:
            speed = slowest
    walks.left[i] = left
    walks.speed[i] = speed
    walks.step[i] = min(speed, left)
    if not walks.step[i] > 0.0:
        walks.way[i] = c.heading[slot]
    elif c.detour[slot] != 0 and (c.aside[slot].x != 0.0 or c.aside[slot].y != 0.0):
        walks.way[i] = c.aside[slot]
    else:
        size = max(distance, NO_DISTANCE)
        walks.way[i] = memory.point(x / size, y / size)


def _turn(c: Columns, walks: _Walks, i: int) -> None:
    """Turn a walker to the way it wants to go; write how far and which way it moves meanwhile."""
    slot = walks.slot[i]
    way = walks.way[i]
    standing = c.speed[slot] <= 0.0 or walks.error_cos[i] < 0.0
    late = walks.error_cos[i] < c.turn_cos[slot]
    cos_step = c.turn_still_cos[slot] if standing else c.turn_cos[slot]
    sin_step = c.turn_still_sin[slot] if standing else c.turn_sin[slot]
    facing = turning.turn(c.heading[slot], way, cos_step, sin_step)
    swings = c.glides[slot] and walks.left[i] > TURNING_CIRCLES * walks.step[i]
    c.heading[slot] = facing
    if late and not swings:
        walks.step[i] *= max(facing.x * way.x + facing.y * way.y, 0.0)
    if swings:
        walks.way[i] = facing
