"""Collision: bodies take their steps, push each other apart, and stay off cliffs, structures and the edge of the map.

The rules: no body ends a loop inside a wall; bodies of one layer keep their distance as far as one loop can restore
it; a walker that makes no headway looks for a way around. Flyers know no walls but the edge of the playable area.

The steps of one loop, and why they come in this order:

1. Every body takes the step that ``systems.movement`` intends. All step before any is pushed, so no body gains by its
   slot.
2. ``movement.pushing`` pushes overlapping bodies apart. It knows no walls and may push a body into one.
3. Every body that moved is put where its layer allows. This comes last because it may undo a push, never the reverse:
   two bodies may still overlap at a wall, but neither stands in it.
4. The positions are written, once. Until then all steps work on copies (``Crowd.before`` and ``Crowd.after``), so the
   whole way, ``after - before``, is known in the end.
5. A walker that went less than ``BLOCKED_SHARE`` of its intended step counts this loop as blocked; at every
   ``DETOUR_AFTER``-th such loop ``systems.avoidance`` begins a detour. A loop with headway takes two off the count.

How a body is kept off a wall: most cells are open, that is, they and all their neighbours are free, and a body there is
let be. Elsewhere the body keeps its ``clearance`` from blocked sides, then from corners at which only the diagonal
neighbour is blocked (``spikes``). If it still ends in a blocked cell, it moves along x alone, else along y alone, else
it stays; if it already stood in a wall, as when a structure lands on it, it leaves towards the nearest free cell.

There is nothing to do while no unit moves, if the last look found no two bodies that touch and no unit came or went
since (``resting_version``).

To be kept in step by hand: code that moves a body without an intended step, such as a teleport, sets
``resting_version`` to -1, or this system does not look.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.movement import contacts, grids, pushing
from khala_simulator.native import columns, memory
from khala_simulator.systems import avoidance
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from khala_simulator.movement.contacts import Crowd
    from khala_simulator.movement.grids import SurfaceGrid
    from khala_simulator.movement.pathfinding import Surface
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.world.world import World

AIR: Final = int(Layer.AIR)
SAME_POINT: Final = 1e-9
EDGE_MARGIN: Final = 1e-6
BLOCKED_SHARE: Final = MECHANICS.blocked_share
DETOUR_AFTER: Final = MECHANICS.detour_after
PUSH_LIMIT: Final = MECHANICS.push_limit


def separate(world: World) -> None:
    """Carry out this loop's steps, push bodies apart and remember blocked walkers."""
    moved = world.anyone_moved
    if not moved and world.resting_version == world.population:
        return
    c = columns.columns_of(world)
    live = world.live
    slots = memory.ints(live)
    crowd = contacts.crowd_of(world)
    crowd.reserve(len(live), c.capacity)
    for i in range(crowd.count):
        at = c.pos[slots[i]]
        crowd.before[i] = at
        if moved:
            step = c.intended[slots[i]]
            at = memory.point(at.x + step.x, at.y + step.y)
        crowd.after[i] = at
    crowded = pushing.push_apart(crowd, c, slots)
    _keep_on_surfaces(world, crowd, c, slots)
    for i in range(crowd.count):
        c.pos[slots[i]] = crowd.after[i]
    world.resting_version = -1 if moved or crowded else world.population
    if moved:
        _note_blocked(world, crowd, c, slots)


def _keep_on_surfaces(world: World, crowd: Crowd, c: Columns, slots: Cells) -> None:
    """Put every body that has moved where its layer allows."""
    ground = world.ground
    x0, y0, x1, y1 = world.west, world.south, world.east, world.north
    grid = None
    last = AIR
    for i in range(crowd.count):
        before = crowd.before[i]
        after = crowd.after[i]
        if before.x == after.x and before.y == after.y:
            continue
        layer = c.layer[slots[i]]
        if layer == AIR:
            crowd.after[i] = memory.point(
                min(max(after.x, x0), x1 - EDGE_MARGIN), min(max(after.y, y0), y1 - EDGE_MARGIN)
            )
            continue
        if grid is None or layer != last:
            grid = grids.grid_of(ground, layer)
            last = layer
        cell = grids.cell_at(grid, after.x, after.y)
        if not grid.open[cell]:
            kept = _off_walls(grid, after, cell, c.clearance[slots[i]])
            crowd.after[i] = _free_or_back(grid, before, kept)


def _off_walls(grid: SurfaceGrid, at: memory.Point, cell: int, room: float) -> memory.Point:
    """Return where a body in a cell keeps its clearance away from blocked cells."""
    corner_x = math.floor(at.x + grid.shift) - grid.shift
    corner_y = math.floor(at.y + grid.shift) - grid.shift
    low = grid.walls_low[cell]
    high = grid.walls_high[cell]
    kept_x = min(max(at.x, corner_x + low.x * room), corner_x + 1.0 - high.x * room)
    kept_y = min(max(at.y, corner_y + low.y * room), corner_y + 1.0 - high.y * room)
    if grid.spiked[cell]:
        for i in range(4):
            if grid.spikes[i][cell]:
                x = kept_x - (corner_x + grid.corners[i].x)
                y = kept_y - (corner_y + grid.corners[i].y)
                distance = memory.length(x, y)
                push = max(room - distance, 0.0) / max(distance, SAME_POINT)
                kept_x += x * push
                kept_y += y * push
    return memory.point(
        min(max(kept_x, 0.0), grid.width - EDGE_MARGIN), min(max(kept_y, 0.0), grid.height - EDGE_MARGIN)
    )


def _free_or_back(grid: SurfaceGrid, before: memory.Point, after: memory.Point) -> memory.Point:
    """Slide along one axis where the new place is blocked, else stay, else leave towards the nearest free cell."""
    if grid.flat[grids.cell_at(grid, after.x, after.y)]:
        return after
    if grid.flat[grids.cell_at(grid, after.x, before.y)]:
        return memory.point(after.x, before.y)
    if grid.flat[grids.cell_at(grid, before.x, after.y)]:
        return memory.point(before.x, after.y)
    if grid.flat[grids.cell_at(grid, before.x, before.y)]:
        return before
    return _leave_wall(grid, before, after)


def _leave_wall(grid: SurfaceGrid, before: memory.Point, after: memory.Point) -> memory.Point:
    """Return where a body goes that stood inside a wall; ``after`` when nothing is free."""
    surface: Surface = grid.surface
    free = surface.nearest_free(np.array((before.x, before.y)))
    if free is None:
        return after
    x, y = surface.centre(np.array(free)).tolist()
    if grid.shift == 0.0:
        return memory.point(x, y)
    x -= before.x  # a body too wide for its distance to a wall leaves it little by little
    y -= before.y
    part = min(1.0, PUSH_LIMIT / max(memory.length(x, y), SAME_POINT))
    return memory.point(before.x + x * part, before.y + y * part)


def _note_blocked(world: World, crowd: Crowd, c: Columns, slots: Cells) -> None:
    """Count the loops in which walkers made no headway, and send stuck ones around the obstacle."""
    stuck_slots = shifts = None
    stuck = 0
    for i in range(crowd.count):
        slot = slots[i]
        intended = c.intended[slot]
        wish = intended.x * intended.x + intended.y * intended.y
        if not wish > 0.0:
            c.blocked[slot] = 0
            continue
        x = crowd.after[i].x - crowd.before[i].x
        y = crowd.after[i].y - crowd.before[i].y
        along = x * intended.x + y * intended.y
        if not along < BLOCKED_SHARE * wish:
            c.blocked[slot] = max(c.blocked[slot] - 2, 0)
            continue
        c.blocked[slot] += 1
        if c.blocked[slot] % DETOUR_AFTER == 0:
            if stuck_slots is None or shifts is None:
                stuck_slots = memory.new_ints(crowd.count)
                shifts = memory.new_points(crowd.count)
            memory.ints(stuck_slots)[stuck] = slot
            memory.points(shifts)[stuck] = memory.point(x - intended.x, y - intended.y)
            stuck += 1
    if stuck_slots is not None and shifts is not None:
        avoidance.begin(world, stuck_slots[:stuck], shifts[:stuck])
