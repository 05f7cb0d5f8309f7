"""Flanking: how melee units that others keep from their targets find another place to fight from.

As soon as one of a kind is blocked, all of its kind that are near follow the flow of ``movement.flow``: round the units
that stand, to the nearest free places from which they reach a target. Those that choose for themselves go for any enemy
that is as good as theirs, the others for their own; ``acquire`` changes the target of a unit that reaches another. So
a second row finds the flanks. Ranged units are left to ``avoidance``. The game's own rule is not known; all of this is
an estimate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.movement import pathfinding
from khala_simulator.movement.flow import Flow
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import which
from khala_simulator.systems.acquire import RANK_STEP, foes_of, rank_of
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import GROUND_PLANE
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

LED = 2  # times the side in ``detour`` of those that follow a flow
ANY = -1
AIR = int(Layer.AIR)


def lead(world: World, blocked: Ints) -> Ints:
    """Write ``aside`` of pursuers of the same kind as some that are blocked; return those for whom there is a way."""
    slots = _pursuers(world)
    if not slots.size:
        return slots
    chooses = world.looks_around.take(slots) & world.acquires.take(slots)
    target = np.where(chooses, ANY, world.target.take(slots))
    kinds = np.stack([world.owner.take(slots), world.type.take(slots), target], axis=1)
    stuck = np.isin(slots, blocked)
    led = [slots[:0]]
    for kind in sorted({tuple(row) for row in kinds[stuck].tolist()}):
        mine = slots[(kinds == kind).all(axis=1)]
        led.append(_follow(world, mine, _foes(world, mine) if kind[2] == ANY else np.array(kind[2:])))
    return np.concatenate(led)


def _pursuers(world: World) -> Ints:
    """Return the melee units on their way to a target that is near; structures are reached at their walls."""
    n = world.top
    pursue = world.wants[:n] & (world.target[:n] != NOBODY) & (world.layer[:n] != AIR)
    pursue &= ~world.walks[:n] | world.looks_around[:n]
    pursue &= (world.reach[:n] <= MECHANICS.flank_reach) & (world.gap[:n] < MECHANICS.flank_look)
    slots = which(pursue)
    chosen: Ints = slots[~world.walled.take(world.target.take(slots))]
    return chosen


def _foes(world: World, slots: Ints) -> Ints:
    """Return the enemies that are as good as the best target of some units of one type that choose for themselves."""
    best = float(rank_of(world, slots, world.target.take(slots)).max())
    foes = foes_of(world, int(world.owner[slots[0]]))
    foes = foes[~world.walled.take(foes) & ((world.plane_bits.take(foes) & GROUND_PLANE) != 0)]
    rank = rank_of(world, np.full(len(foes), slots[0]), foes)
    chosen: Ints = foes[rank > best - RANK_STEP]
    return chosen


def _follow(world: World, slots: Ints, foes: Ints) -> Ints:
    """Lead units of one type to the nearest free places in reach of any of the foes; return those with a way."""
    one = int(slots[0])
    at, width = world.pos.take(slots, 0), float(world.separation[one])
    flow = Flow(pathfinding.surface(world.ground, Layer(int(world.layer[one]))), at)
    standing = _standing(world, one)
    squeeze = MECHANICS.flank_squeeze
    flow.stand(world.pos.take(standing, 0), world.separation.take(standing) + (width - squeeze))
    reach = world.radius.take(foes) + world.radius[one] + world.reach[slots].min()
    touch = world.separation.take(foes) + width
    flow.reach(world.pos.take(foes, 0), np.maximum(reach, touch) - MECHANICS.chase_slack)
    points, found = flow.points(at, world.pos.take(world.target.take(slots), 0), 2.0 * width - squeeze)
    offset = points - at
    distance = geometry.length(offset)
    found &= distance > 0.0
    slots = slots[found]
    world.aside[slots] = (offset / np.maximum(distance, 1e-9)[:, None])[found]
    world.detour[slots] = np.where(world.detour.take(slots) < 0, -LED, LED)
    world.detour_end[slots] = world.loop + MECHANICS.detour_loops
    return slots


def _standing(world: World, one: int) -> Ints:
    """Return the bodies that a unit has to go around: enemies that stand, and friends that fight or hold."""
    bodies = world.live
    bodies = bodies[(world.layer_bits.take(bodies) & world.layer_bits[one]) != 0]
    bodies = bodies[~world.walled.take(bodies) & ~world.wants.take(bodies)]
    busy = (world.target.take(bodies) != NOBODY) | world.holds.take(bodies)
    chosen: Ints = bodies[busy | (world.owner.take(bodies) != world.owner[one])]
    return chosen
