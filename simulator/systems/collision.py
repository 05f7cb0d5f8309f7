"""Collision: bodies are pushed apart and kept off cliffs, structures and the edge of the map.

All bodies take their intended step, overlapping pairs are pushed apart along the line between their centres a few
times over, and finally everybody is put where its layer allows. Who gives way: a walker before one that fights or
holds, an idle unit before a friend that comes through, nobody before an enemy. How much is an estimate (see
``data/mechanics.yaml``); that nobody ends inside a wall is not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator import geometry
from simulator.mechanics import MECHANICS
from simulator.orders import OrderKind
from simulator.traits import Layer
from simulator.world import NOBODY

if TYPE_CHECKING:
    from simulator.geometry import Floats
    from simulator.pathing import Surface
    from simulator.world import Bools, Ints, World

CONTACT_SKIN = 0.3
OVERLAP_ALLOWED = 1e-3
EDGE_MARGIN = 1e-6
WALL_NEIGHBOURS = np.array([(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)])


def separate(world: World) -> None:
    """Carry out this loop's steps, push bodies apart and remember who could not get on."""
    slots = world.live
    before = world.pos[slots]
    after = before + world.intended[slots]
    stirred = bool(world.wants[slots].any())
    if not stirred and world.settled == world.population:
        return
    crowded = _push_apart(world, slots, after)
    _keep_on_surfaces(world, slots, before, after)
    world.pos[slots] = after
    world.settled = -1 if stirred or crowded else world.population
    if stirred:
        _note_blocked(world, slots, before, after)


def _push_apart(world: World, slots: Ints, after: Floats) -> bool:
    """Move overlapping bodies apart in place; returns whether anybody was touched."""
    first, second, apart = _contacts(world, after)
    if not first.size:
        return False
    give_first, give_second = _shares(world, slots[first], slots[second])
    start, touched = after.copy(), False
    for _ in range(MECHANICS.push_iterations):
        offset = after[first] - after[second]
        distance = geometry.length(offset)
        depth = apart - distance
        if not (depth > OVERLAP_ALLOWED).any():
            break
        touched = True
        np.maximum(depth, 0.0, out=depth)
        normal = offset / np.maximum(distance, 1e-9)[:, None]
        normal[distance < 1e-9] = _any_direction(first[distance < 1e-9], second[distance < 1e-9])
        n = len(slots)
        for axis in (0, 1):
            push = normal[:, axis] * depth
            after[:, axis] += np.bincount(first, push * give_first, n) - np.bincount(second, push * give_second, n)
    if touched:
        shift = after - start
        far = geometry.length(shift)
        scale = np.minimum(1.0, MECHANICS.push_limit / np.maximum(far, 1e-12))
        after[:] = start + shift * scale[:, None]
    return touched


def _contacts(world: World, at: Floats) -> tuple[Ints, Ints, Floats]:
    """Pairs of bodies that touch or nearly do, as indices into ``live``, and how far apart they have to be."""
    if world.pairs is None:
        world.pairs = pair_table(world)
    reach_squared, apart = world.pairs
    x, y = at[:, 0], at[:, 1]
    dx, dy = x[:, None] - x, y[:, None] - y
    dx *= dx
    dy *= dy
    dx += dy
    first, second = np.nonzero(dx < reach_squared)
    return first, second, apart[first, second]


def pair_table(world: World) -> tuple[Floats, Floats]:
    """For every pair of living units the squared distance worth looking at (-1: never) and the one to keep.

    Only the upper half counts. Bodies collide when they share a layer; what stands on a footprint is a wall, not a
    body.
    """
    slots = world.live
    bits = np.where(world.walled[slots], 0, world.layer_bits[slots])
    radius = world.separation[slots]
    apart = radius[:, None] + radius
    meets = np.triu((bits[:, None] & bits) != 0, 1)
    return np.where(meets, (apart + CONTACT_SKIN) ** 2, -1.0), apart


def _shares(world: World, first: Ints, second: Ints) -> tuple[Floats, Floats]:
    """How much of an overlap each of a pair gives way, adding up to 1."""
    friends = world.owner[first] == world.owner[second]
    a, b = _yielding(world, first, friends), _yielding(world, second, friends)
    total = a + b
    return a / total, b / total


def _yielding(world: World, slots: Ints, to_friend: Bools) -> Floats:
    walking = world.wants[slots]
    idle = (world.order_kind[slots] != OrderKind.HOLD) & (world.target[slots] == NOBODY)
    standing = np.where(idle & to_friend, MECHANICS.push_idle, MECHANICS.push_firm)
    immobile = world.step_max[slots] <= 0.0
    return np.where(walking, 1.0, np.where(immobile, 1e-6, standing))


def _any_direction(first: Ints, second: Ints) -> Floats:
    """Unit vectors for bodies on the very same point: one of eight, by their numbers."""
    eight = WALL_NEIGHBOURS / geometry.length(WALL_NEIGHBOURS.astype(np.float64))[:, None]
    result: Floats = eight[(first * 3 + second) % len(eight)]
    return result


def _keep_on_surfaces(world: World, slots: Ints, before: Floats, after: Floats) -> None:
    layers = world.layer[slots]
    moved = np.logical_or.reduce(before != after, axis=1)
    for layer in Layer:
        mine = np.flatnonzero(moved & (layers == layer))
        if not mine.size:
            continue
        if layer is Layer.AIR:
            x0, y0, x1, y1 = world.map.terrain.playable
            after[mine] = np.clip(after[mine], (x0, y0), (x1 - EDGE_MARGIN, y1 - EDGE_MARGIN))
            continue
        surface = world.ground.surface(layer)
        width, height = world.map.terrain.size
        after[mine] = np.clip(after[mine], 0.0, (width - EDGE_MARGIN, height - EDGE_MARGIN))
        near = mine[~surface.open[surface.cell(after[mine])]]
        if near.size:
            after[near] = _off_walls(surface, before[near], after[near], world.clearance[slots[near]])


def _off_walls(surface: Surface, before: Floats, after: Floats, clearance: Floats) -> Floats:
    """Positions (k, 2) pushed out of blocked cells; what can't be helped stays where it was."""
    for _ in range(2):
        cell = np.floor(after)
        corner = cell[:, None, :] + WALL_NEIGHBOURS
        nearest = np.clip(after[:, None, :], corner, corner + 1.0)
        offset = after[:, None, :] - nearest
        distance = geometry.length(offset)
        depth = np.where(_blocked(surface, corner), clearance[:, None] - distance, 0.0)
        deepest = np.argmax(depth, axis=1)
        rows = np.arange(len(after))
        depth, offset, distance = depth[rows, deepest], offset[rows, deepest], distance[rows, deepest]
        push = np.where(depth > 0.0, depth / np.maximum(distance, 1e-9), 0.0)
        after = after + offset * push[:, None]
    return _free_or_back(surface, before, after)


def _blocked(surface: Surface, corner: Floats) -> Bools:
    x, y = corner[..., 0].astype(np.int64), corner[..., 1].astype(np.int64)
    inside = (x >= 0) & (y >= 0) & (x < surface.width) & (y < surface.height)
    index = np.where(inside, y * surface.width + x, 0)
    blocked: Bools = ~(inside & surface.flat[index])
    return blocked


def _free_or_back(surface: Surface, before: Floats, after: Floats) -> Floats:
    """Where the new place is blocked: slide along one axis, else stay, else leave towards the nearest free cell."""
    limit = np.array([surface.width - EDGE_MARGIN, surface.height - EDGE_MARGIN])
    after = np.clip(after, 0.0, limit)
    bad = ~surface.flat[surface.cell(after)]
    for axes in ((0,), (1,), ()):
        if not bad.any():
            return after
        attempt = before.copy()
        for axis in axes:
            attempt[:, axis] = after[:, axis]
        fits = bad & surface.flat[surface.cell(attempt)]
        after[fits] = attempt[fits]
        bad &= ~fits
    for i in np.flatnonzero(bad).tolist():
        free = surface.nearest_free(before[i])
        if free is not None:
            after[i] = surface.centre(np.array(free))
    return after


def _note_blocked(world: World, slots: Ints, before: Floats, after: Floats) -> None:
    """Count the loops in which walkers made no headway, and send those that are stuck around the obstacle."""
    intended = world.intended[slots]
    wish = intended[:, 0] ** 2 + intended[:, 1] ** 2
    real = after - before
    made = real[:, 0] * intended[:, 0] + real[:, 1] * intended[:, 1]
    walking = wish > 0.0
    hindered = walking & (made < MECHANICS.blocked_share * wish)
    blocked = world.blocked[slots]
    blocked = np.where(hindered, blocked + 1, np.maximum(blocked - 2, 0))
    world.blocked[slots] = np.where(walking, blocked, 0)
    stuck = np.flatnonzero(hindered & (blocked % MECHANICS.detour_after == 0))
    if stuck.size:
        _send_around(world, slots[stuck], intended[stuck], (real - intended)[stuck])


def _send_around(world: World, slots: Ints, intended: Floats, shift: Floats) -> None:
    """Begin a detour to the side the obstacle pushes to; one that leads nowhere is tried on the other side."""
    side = np.where(intended[:, 0] * shift[:, 1] - intended[:, 1] * shift[:, 0] >= 0.0, 1, -1)
    under_way = world.detour[slots] != 0
    world.detour[slots] = np.where(under_way, -world.detour[slots], side)
    world.detour_loop[slots] = world.loop + MECHANICS.detour_loops
