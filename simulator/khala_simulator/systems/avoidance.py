"""Avoidance: how a walker that bodies block finds a heading around them.

Melee units go where ``flanking`` leads them. Any other blocked walker goes round those who stand ahead of it, on the
side where fewer of them are: so a crowd parts in two, and ranged units spread into an arc. It looks in a fan of
headings around its way, on that side first, takes the free one that turns it least, and keeps the side until it has
made progress for a while. Bodies that stand or come towards it and the terrain count as obstacles, ``collision``
handles those that go the same way. The game's own local avoidance is not known; all of this is an estimate.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.movement import pathfinding
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import which
from khala_simulator.systems import flanking
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.columns import Bools, Ints
    from khala_simulator.world.world import World

FAN_DEG = (0.0, 25.0, 50.0, 75.0, 100.0, 130.0)
FAN_COS = np.array([math.cos(math.radians(a)) for a in FAN_DEG] * 2)  # to one side, then to the other
FAN_SIN = np.array([sign * math.sin(math.radians(a)) for sign in (1.0, -1.0) for a in FAN_DEG])
SEEN_AHEAD = 0.7
TOLERANCE = 0.02
LAYERS = tuple(Layer)
AIR = Layer.AIR


def find_headings(world: World) -> None:
    """Write ``aside`` of walkers that have to go around others; it is checked every few loops."""
    n = world.top
    if not np.count_nonzero(world.detour[:n]):
        return
    if world.loop % MECHANICS.detour_period:
        return
    turning = which(world.detour[:n] != 0)
    over = (world.detour_end.take(turning) <= world.loop) | ~world.wants.take(turning)
    world.detour[turning[over]] = 0
    world.aside[turning[over]] = 0.0
    due = turning[~over]
    flowing = _flowing(world, due)
    # in the middle of the usual step of 8 loops: who gets a new order at every step is led for the rest of it
    if (world.loop - MECHANICS.detour_period) % MECHANICS.flank_period == 0 and due.size:
        world.detour[due[flowing]] //= flanking.LED
        flanking.lead(world, due)
        flowing = _flowing(world, due)
    due = due[~flowing]
    if due.size:
        _look(world, due)


def _flowing(world: World, slots: Ints) -> Bools:
    flowing: Bools = np.abs(world.detour.take(slots)) == flanking.LED
    return flowing


def begin(world: World, slots: Ints, shift: Floats) -> None:
    """Make blocked walkers look for a way around, first on the side where fewer stand or to which ``shift`` pushed."""
    kept = world.detour.take(slots)
    world.detour_end[slots] = world.loop + MECHANICS.detour_loops
    new = which(kept == 0)
    if not new.size:
        return
    slots, shift = slots.take(new), shift.take(new, 0)
    intended = world.intended.take(slots, 0)
    beside = _beside(world, slots, intended)
    pushed = intended[:, 0] * shift[:, 1] - intended[:, 1] * shift[:, 0]
    world.detour[slots] = np.where(np.where(beside == 0.0, pushed, -beside) >= 0.0, 1, -1)


def _beside(world: World, slots: Ints, way: Floats) -> Floats:
    """Return (k,) how far to the left of their ways the bodies stand that are near and ahead, summed up."""
    bodies = world.live
    bodies = bodies[~world.wants.take(bodies) & (world.layer.take(bodies) != AIR)]
    at, there = world.pos.take(slots, 0), world.pos.take(bodies, 0)
    dx, dy = there[:, 0] - at[:, 0, None], there[:, 1] - at[:, 1, None]
    x, y = way[:, 0, None], way[:, 1, None]
    near = dx * dx + dy * dy < MECHANICS.detour_look**2
    near &= dx * x + dy * y > 0.0
    dy *= x
    dx *= y
    dy -= dx
    dy *= near
    beside: Floats = np.add.reduce(dy, axis=1)
    return beside


def _look(world: World, slots: Ints) -> None:
    start = world.pos.take(slots, 0)
    way = world.nav_point.take(slots, 0) - start
    way /= np.maximum(geometry.length(way), 1e-12)[:, None]
    side = world.detour.take(slots).astype(np.float64)
    headings = _fan(way, side)
    free = _free(world, slots, start, way, headings)
    first = np.argmax(free, axis=1)
    rows = np.arange(len(slots))
    found = free[rows, first]
    chosen = headings[:, rows, first].T
    straight = found & (first == 0)
    # an army on its way to a fight keeps to its sides: who turned back would meet those that follow
    turns = found & (first > len(FAN_DEG)) & (world.target.take(slots) != NOBODY)
    world.detour[slots] = np.where(turns, -side, side)
    world.aside[slots] = np.where((found & ~straight)[:, None], chosen, 0.0)


def _fan(way: Floats, side: Floats) -> Floats:
    """Return (2, k, 2 x fan) headings turned further and further to a side (1 is left), then to the other side."""
    sine = FAN_SIN * side[:, None]
    x, y = way[:, 0, None], way[:, 1, None]
    headings = np.empty((2, *sine.shape))
    np.subtract(x * FAN_COS, y * sine, out=headings[0])
    np.add(y * FAN_COS, x * sine, out=headings[1])
    return headings


def _free(world: World, slots: Ints, start: Floats, way: Floats, headings: Floats) -> Bools:
    """Return (k, h) which headings (2, k, h) have no wall and no body that stands or comes within ``SEEN_AHEAD``."""
    points = np.empty((*headings.shape[1:], 2))
    for axis in (0, 1):
        np.add(start[:, axis, None], headings[axis] * SEEN_AHEAD, out=points[..., axis])
    free = _on_ground(world, slots, points)
    k, body, apart = _in_the_way(world, slots, start, way)
    if k.size:
        ahead = headings.take(k, 1)  # (2, p, h)
        x, y = body[:, 0, None], body[:, 1, None]
        along = ahead[0] * x
        along += ahead[1] * y
        across = ahead[0] * y
        across -= ahead[1] * x
        across *= across
        reach = np.maximum(along - SEEN_AHEAD, 0.0)
        reach *= reach
        across += reach
        struck = which(((along > 0.0) & (across < apart[:, None] ** 2)).ravel())
        pair = struck // free.shape[1]
        free[k.take(pair), struck - pair * free.shape[1]] = False
    return free


def _in_the_way(world: World, slots: Ints, start: Floats, way: Floats) -> tuple[Ints, Floats, Floats]:
    """Return bodies near ``slots`` that block them: (p,) index into ``slots``, (p, 2) offset, (p,) distance to keep."""
    bodies = world.live[~world.walled[world.live]]
    there = world.pos.take(bodies, 0)
    farthest = world.separation.take(slots) + float(world.separation.take(bodies).max()) + SEEN_AHEAD
    near = which((_squared(start, there) < (farthest * farthest)[:, None]).ravel())
    k = near // len(bodies)  # one index into a table costs a third of two
    one, other = slots.take(k), bodies.take(near - k * len(bodies))
    offset = world.pos.take(other, 0) - start.take(k, 0)
    apart = world.separation.take(one) + world.separation.take(other) - TOLERANCE
    product = way.take(k, 0) * world.intended.take(other, 0)
    meets = (world.layer_bits.take(one) & world.layer_bits.take(other)) != 0
    meets &= (other != one) & (other != world.target.take(one))
    meets &= product[:, 0] + product[:, 1] <= 0.0
    meets &= offset[:, 0] ** 2 + offset[:, 1] ** 2 < (apart + SEEN_AHEAD) ** 2
    return k[meets], offset[meets], apart[meets]


def _squared(at: Floats, there: Floats) -> Floats:
    """Return (k, m) the distances of points (k, 2) from others (m, 2), squared."""
    squared = there[:, 0] - at[:, 0, None]
    squared *= squared
    dy = there[:, 1] - at[:, 1, None]
    dy *= dy
    squared += dy
    return squared


def _on_ground(world: World, slots: Ints, points: Floats) -> Bools:
    free = np.ones(points.shape[:2], dtype=np.bool_)
    layers = world.layer.take(slots)
    for layer in LAYERS:
        mine = which(layers == layer.value)
        if layer is not AIR and mine.size:
            surface = pathfinding.surface(world.ground, layer)
            free[mine] = surface.flat.take(surface.cell(points.take(mine, 0)))
    return free
