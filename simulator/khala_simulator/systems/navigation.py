"""Navigation: the next corner on every walker's way, round cliffs and structures.

A unit whose straight line is free heads for its goal; the others follow the shortest way over the cells, cut short to
the farthest corner they can walk to straight. ``collision`` handles bodies in the way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.movement import pathfinding
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some, which
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from khala_simulator.movement.pathfinding import Surface
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.columns import Bools, Ints
    from khala_simulator.world.world import World

CORNER_REACHED = 0.4
NEAR_CORNER = 1.8
HEADWAY = 0.25  # so much nearer to the goal counts as progress
LOOK_PERIOD = 4  # checking many at once costs little more than checking one
LAYERS = tuple(Layer)
AIR = Layer.AIR


def find_ways(world: World) -> None:
    """Write ``nav_point`` of every unit that wants to move; ways are checked every few loops."""
    n = world.top
    walkers = which(world.wants[:n])
    if not walkers.size:
        return
    straight = walkers[world.nav_straight.take(walkers)]
    world.nav_point[straight] = world.goal.take(straight, 0)
    due = world.nav_loop.take(walkers) <= (world.loop if world.loop % LOOK_PERIOD == 0 else 0)
    if not some(due):
        return
    walkers = walkers[due]
    layers = world.layer.take(walkers)
    for layer in LAYERS:
        on_layer = walkers[layers == layer.value]
        if on_layer.size:
            _look_over(world, on_layer, layer)
    left = geometry.length(world.nav_point.take(walkers, 0) - world.pos.take(walkers, 0))
    soon = ~world.nav_straight.take(walkers) & (left < NEAR_CORNER)
    world.nav_loop[walkers] = world.loop + np.where(soon, LOOK_PERIOD, MECHANICS.path_period)


def _look_over(world: World, slots: Ints, layer: Layer) -> None:
    goal = world.goal.take(slots, 0)
    surface = pathfinding.surface(world.ground, layer)
    straight = np.ones(len(slots), dtype=np.bool_)
    if layer is not AIR:
        straight = surface.clear(world.pos.take(slots, 0), _stopping_point(world, slots, goal))
    world.nav_straight[slots] = straight
    world.nav_end[slots] = False
    world.nav_point[slots] = world.nav_goal[slots] = goal
    crooked = slots[~straight]
    if crooked.size:
        _find_corners(world, crooked, surface)
    _note_progress(world, slots)


def _find_corners(world: World, crooked: Ints, surface: Surface) -> None:
    """Send walkers whose straight line is not free to the next corner of their way."""
    start, goal = world.pos.take(crooked, 0), world.goal.take(crooked, 0)
    cells = surface.cell(goal)
    wanted = cells.copy()
    parts = surface.part.take(surface.cell(start))
    usable = parts >= 0
    for i in _by_goal(goal, parts, usable & (surface.part.take(cells) != parts)):
        cells[i] = surface.nearest(goal[i[0]], int(parts[i[0]]), start[i])
    elsewhere = wanted != cells
    crooked, start, cells, elsewhere = crooked[usable], start[usable], cells[usable], elsewhere[usable]
    if crooked.size:
        world.nav_goal[crooked[elsewhere]] = surface.centre(cells[elsewhere])
        centre = surface.centre(cells)
        at_goal = surface.cell(start) == cells
        world.nav_point[crooked] = np.where(at_goal[:, None], centre, surface.corners(start, cells))
        offset = centre - start
        world.nav_end[crooked] = at_goal & (offset[:, 0] ** 2 + offset[:, 1] ** 2 < CORNER_REACHED**2)


def _by_goal(goals: Floats, parts: Ints, chosen: Bools) -> list[list[int]]:
    """Return the numbers of the chosen walkers, those together that are in the same part and have the same goal."""
    groups: dict[tuple[float, ...], list[int]] = {}
    at = which(chosen)
    for i, goal, part in zip(at.tolist(), goals.take(at, 0).tolist(), parts.take(at).tolist(), strict=True):
        groups.setdefault((*goal, part), []).append(i)
    return list(groups.values())


def _note_progress(world: World, slots: Ints) -> None:
    """Remember how near to its goal each walker has come on this way, and when."""
    left = geometry.length(world.nav_goal.take(slots, 0) - world.pos.take(slots, 0))
    nearer = (world.nav_loop.take(slots) == 0) | (left < world.nav_best.take(slots) - HEADWAY)
    world.nav_best[slots] = np.where(nearer, left, world.nav_best.take(slots))
    world.nav_best_loop[slots] = np.where(nearer, world.loop, world.nav_best_loop.take(slots))


def _stopping_point(world: World, slots: Ints, goal: Floats) -> Floats:
    """Return (k, 2) where each unit would stop on a straight way; a target on a footprint is reached from beside it."""
    offset = world.pos.take(slots, 0) - goal
    distance = geometry.length(offset)
    share = np.minimum(world.stop_at.take(slots) / np.maximum(distance, 1e-12), 1.0)
    result: Floats = goal + offset * share[:, None]
    return result
