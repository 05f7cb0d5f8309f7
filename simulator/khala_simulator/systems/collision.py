"""Collision: bodies are pushed apart and kept off cliffs, structures and the edge of the map.

All bodies take their intended step, overlapping pairs are pushed apart along the line between their centres a few times
over, and finally every body is put where its layer allows. A walker gives way to a unit that fights, and an idle unit
to a friend that comes through. No unit gives way to an enemy, and one that holds its place gives way to none. Flyers
pass through each other and drift apart where they stop. How much is an estimate (see ``data/mechanics.yaml``), but no
body ever ends inside a wall.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.movement import pathfinding
from khala_simulator.movement.contacts import OVERLAP_ALLOWED, Pairs, bodies_of
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some, which
from khala_simulator.systems import avoidance
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.census import census
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.movement.pathfinding import Surface
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.columns import Bools, Ints
    from khala_simulator.world.world import World

OVERLAP_PRESSED = 0.1
SAME_POINT = 1e-9
STIR = 1e3
EDGE_MARGIN = 1e-6
IMMOBILE_YIELDING = 1e-6
EVEN = 0.5 - 1e-9
LAYERS = tuple(Layer)
AIR = Layer.AIR
EIGHT_DIRECTIONS = np.array([(math.cos(i * math.pi / 4), math.sin(i * math.pi / 4)) for i in range(8)])


def separate(world: World) -> None:
    """Carry out this loop's steps, push bodies apart and remember blocked walkers."""
    if not world.anyone_moved and world.resting_version == world.population:
        return
    slots = world.live
    before = world.pos.take(slots, 0)
    after = before + world.intended.take(slots, 0) if world.anyone_moved else before.copy()
    crowded = _push_apart(world, slots, before, after)
    _keep_on_surfaces(world, slots, before, after)
    world.pos[slots] = after
    world.resting_version = -1 if world.anyone_moved or crowded else world.population
    if world.anyone_moved:
        _note_blocked(world, slots, before, after)


def _push_apart(world: World, slots: Ints, before: Floats, after: Floats) -> bool:
    """Move overlapping bodies apart in place; return whether any body was touched.

    Walkers that still overlap afterwards take their step back and are pushed from where they stood, so that a crowd
    does not press itself together.
    """
    bodies = bodies_of(world)
    found = bodies.near(after)
    if found is None:
        return False
    _part(after, found)
    start = after.copy()
    drifting = False
    if bodies.any_flying:
        flying = bodies.flying.take(found.both)
        soft = flying[0] | flying[1]
        if some(soft):
            drifting = _drift_apart(world, slots, after, _only(found, soft))
            found = _only(found, ~soft)
    if found.apart.size:
        pairs = _Pairs(found.both, found.apart, _shares(world, slots, found.both), len(after))
        deep = pairs.relax(after, MECHANICS.push_rounds)
        if deep.size:
            pressed = found.one.take(deep[pairs.share.take(deep) >= EVEN])
            after[pressed] = start[pressed] = before.take(pressed, 0)
            pairs.relax(after, MECHANICS.push_rounds - 1)
    shift = after - start
    far = geometry.length(shift)
    if np.maximum.reduce(far) > MECHANICS.push_limit:
        shift *= np.minimum(1.0, MECHANICS.push_limit / np.maximum(far, 1e-12))[:, None]
        np.add(start, shift, out=after)
    return bool(found.apart.size) or drifting


def _only(pairs: Pairs, chosen: Bools) -> Pairs:
    return Pairs(pairs.both.compress(chosen, 1), pairs.apart[chosen], pairs.closest)


def _drift_apart(world: World, slots: Ints, at: Floats, pairs: Pairs) -> bool:
    """Separate flyers that hover over each other little by little, in place; those on their way pass through."""
    still = ~world.wants.take(slots) & ~world.holds.take(slots) & (world.step_max.take(slots) > 0.0)
    gives = still.take(pairs.one) & ~world.wants.take(slots).take(pairs.other)
    if not some(gives):
        return False
    pairs = _only(pairs, gives)
    offset = at.take(pairs.one, 0) - at.take(pairs.other, 0)
    distance = geometry.length(offset)
    depth = np.maximum(pairs.apart - distance, 0.0)
    push = np.minimum(depth * MECHANICS.flyer_drift, MECHANICS.flyer_drift_limit) / np.maximum(distance, SAME_POINT)
    offset *= push[:, None]
    np.add.at(at, pairs.one, offset)
    return some(depth > OVERLAP_ALLOWED)


class _Pairs:
    """Bodies near each other, as indices into ``count`` living slots; every pair is there both ways round."""

    def __init__(self, both: Ints, apart: Floats, share: Floats, count: int) -> None:
        self.both = both  # (2, k)
        self.apart = apart  # (k,) distance to keep
        self.share = share  # (k,) part of an overlap by which the first gives way
        self.count = count
        self._pushed = np.concatenate((both[0], both[0] + count))  # where its x and y are in (2, count)

    def relax(self, at: Floats, rounds: int) -> Ints:
        """Push overlapping pairs apart up to ``rounds`` times, in place; return those that stay deep in each other."""
        axes = np.ascontiguousarray(at.T)  # (2, n)
        flat = axes.reshape(-1)
        while True:
            points = axes.take(self.both, 1)
            offset = points[:, 0] - points[:, 1]
            squared = offset * offset
            distance = squared[0] + squared[1]
            np.sqrt(distance, out=distance)
            depth = self.apart - distance
            if rounds == 0 or not some(depth > OVERLAP_ALLOWED):
                break
            rounds -= 1
            push = np.maximum(depth, 0.0, out=depth)
            push /= np.maximum(distance, SAME_POINT, out=distance)
            push *= self.share
            offset *= push
            flat += np.bincount(self._pushed, offset.reshape(-1), 2 * self.count)
        at[:] = axes.T
        return which(depth > OVERLAP_PRESSED)


def _part(at: Floats, pairs: Pairs) -> None:
    """Give bodies on the very same point a direction to separate in: one of eight, by their numbers."""
    if pairs.closest >= SAME_POINT:
        return
    offset = at.take(pairs.one, 0) - at.take(pairs.other, 0)
    offset *= offset
    same = offset[:, 0] + offset[:, 1] < SAME_POINT
    stirred = np.unique(pairs.one[same])
    at[stirred] += EIGHT_DIRECTIONS[stirred % 8] * (1.0 + stirred[:, None]) * SAME_POINT * STIR


def _shares(world: World, slots: Ints, both: Ints) -> Floats:
    """Return the share of an overlap by which the first of each pair (2, k) gives way; the other takes the rest."""
    wants = world.wants.take(slots)
    yielding, yielding_to_friend = _yielding(world, slots, wants)
    yields = yielding.take(both)
    if yielding_to_friend is not None:
        owner = world.owner.take(slots).take(both)
        yields = np.where(owner[0] == owner[1], yielding_to_friend.take(both), yields)
    wanting = wants.take(both)
    rivals = wanting[0] & wanting[1]
    mine, theirs = yields
    if some(rivals):
        left = _left(world, slots).take(both)
        mine[rivals & (left[1] > left[0])] *= MECHANICS.push_ahead
        theirs[rivals & (left[1] < left[0])] *= MECHANICS.push_ahead
    share: Floats = mine / (mine + theirs)
    return share


def _left(world: World, slots: Ints) -> Floats:
    """Return the distance of each of ``slots`` to its next corner, squared; the nearer unit goes first."""
    offset = world.nav_point.take(slots, 0) - world.pos.take(slots, 0)
    offset *= offset
    left: Floats = offset[:, 0] + offset[:, 1]
    return left


def _yielding(world: World, slots: Ints, wants: Bools) -> tuple[Floats, Floats | None]:
    """Return how easily each of ``slots`` is pushed by an enemy, and by a friend; None when it is the same for all."""
    firm = np.where(wants, 1.0, MECHANICS.push_firm)
    if census(world).low_priority_bodies:
        firm *= world.lightness.take(slots)
    immobile = (world.step_max.take(slots) <= 0.0) | world.holds.take(slots)
    if some(immobile):
        firm[immobile] = IMMOBILE_YIELDING
    idle = world.target.take(slots) == NOBODY
    if not some(idle):
        return firm, None
    idle &= ~(wants | immobile)
    return firm, np.where(idle, MECHANICS.push_idle * world.lightness.take(slots), firm)


def _keep_on_surfaces(world: World, slots: Ints, before: Floats, after: Floats) -> None:
    """Put every body that has moved where its layer allows."""
    moved = _moved(before, after)
    layers = world.layer.take(slots.take(moved))
    for layer in LAYERS:
        mine = moved[layers == layer.value]
        if not mine.size:
            continue
        to = after.take(mine, 0)
        if layer is AIR:
            x0, y0, x1, y1 = world.map.terrain.playable
            after[mine] = np.minimum(np.maximum(to, (x0, y0)), (x1 - EDGE_MARGIN, y1 - EDGE_MARGIN))
            continue
        surface = pathfinding.surface(world.ground, layer)
        cell = surface.cell(to)
        near = which(~surface.open.take(cell))
        if near.size:
            mine = mine.take(near)
            room = world.clearance.take(slots.take(mine))
            after[mine] = _off_walls(surface, before.take(mine, 0), to.take(near, 0), cell.take(near), room)


def _moved(before: Floats, after: Floats) -> Ints:
    """Return the bodies that have moved; only they need correction."""
    changed = before != after
    return which(changed[:, 0] | changed[:, 1])


def _off_walls(surface: Surface, before: Floats, after: Floats, cell: Ints, clearance: Floats) -> Floats:
    """Return positions (k, 2) kept a body's clearance away from blocked cells; where there is no room they stay."""
    corner = np.floor(after + surface.shift) - surface.shift if surface.shift else np.floor(after)
    room = clearance[:, None]
    low, high = surface.walls_low.take(cell, 0), surface.walls_high.take(cell, 0)
    kept = np.minimum(np.maximum(after, corner + low * room), corner + 1.0 - high * room)
    if some(surface.spiked.take(cell)):
        for toward, spiked in surface.spikes:
            at = which(spiked.take(cell))
            if at.size:
                offset = kept.take(at, 0) - (corner.take(at, 0) + toward)
                distance, room = geometry.length(offset), clearance.take(at)
                push = np.maximum(room - distance, 0.0) / np.maximum(distance, SAME_POINT)
                kept[at] += offset * push[:, None]
    return free_or_back(surface, before, kept)


def free_or_back(surface: Surface, before: Floats, after: Floats) -> Floats:
    """Slide along one axis where the new place is blocked, else stay, else leave towards the nearest free cell."""
    after = np.minimum(np.maximum(after, 0.0), (surface.width - EDGE_MARGIN, surface.height - EDGE_MARGIN))
    bad = ~surface.flat.take(surface.cell(after))
    for axes in ((0,), (1,), ()):
        if not some(bad):
            return after
        attempt = before.copy()
        for axis in axes:
            attempt[:, axis] = after[:, axis]
        fits = bad & surface.flat.take(surface.cell(attempt))
        after[fits] = attempt[fits]
        bad &= ~fits
    for i in which(bad).tolist():
        free = surface.nearest_free(before[i])
        if free is not None:
            after[i] = surface.centre(np.array(free))
            if surface.shift:  # what is too near to a wall for its body leaves it little by little
                after[i] = before[i] + _at_most(after[i] - before[i], MECHANICS.push_limit)
    return after


def _at_most(vector: Floats, length: float) -> Floats:
    shortened: Floats = vector * min(1.0, length / max(float(geometry.length(vector)), SAME_POINT))
    return shortened


def _note_blocked(world: World, slots: Ints, before: Floats, after: Floats) -> None:
    """Count the loops in which walkers made no headway, and send stuck ones around the obstacle."""
    intended = world.intended.take(slots, 0)
    real = after - before
    squared, along = intended * intended, real * intended
    wish = squared[:, 0] + squared[:, 1]
    hindered = along[:, 0] + along[:, 1] < MECHANICS.blocked_share * wish
    blocked = world.blocked.take(slots)
    if not some(hindered) and not np.count_nonzero(blocked):
        return
    blocked = np.where(hindered, blocked + 1, np.maximum(blocked - 2, 0)) * (wish > 0.0)
    world.blocked[slots] = blocked
    stuck = which(hindered & (blocked % MECHANICS.detour_after == 0))
    if stuck.size:
        avoidance.begin(world, slots[stuck], (real - intended)[stuck])
