"""Flanking: how melee units that others keep from their targets find another place to fight from.

As soon as one of them is blocked, all of its owner and size that are near follow the flow of ``movement.flow``: round
the units that stand, to the nearest free places from which they reach a target. Those that choose for themselves go for
any enemy that is as good as theirs, the others for their own; ``acquire`` changes the target of a unit that reaches
another. So a second row finds the flanks. Ranged units are left to ``avoidance``. The game's own rule is not known; all
of this is an estimate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from khala_simulator.movement import pathfinding
from khala_simulator.movement.flow import Flow
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some, which
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import GROUND_PLANE
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

RANK_STEP: Any = 250.0
foes_of: Any = None
rank_of: Any = None
LED = 2  # times the side in ``detour`` of those that follow a flow
ANY = -1
AIR = int(Layer.AIR)


def lead(world: World, blocked: Ints) -> None:
    """Write ``aside`` and ``detour`` of pursuers for whom there is a way, of the same kind as some that are blocked."""
    slots = _pursuers(world)
    stuck = np.zeros(world.top, dtype=np.bool_)
    stuck[blocked] = True
    if not some(stuck.take(slots)):
        return
    standing = _standing(world)
    for kind in _kinds(world, slots):
        if some(stuck.take(kind)):
            _follow(world, kind, standing)


def _pursuers(world: World) -> Ints:
    """Return the melee units on their way to a target that is near; structures are reached at their walls."""
    n = world.top
    pursue = world.wants[:n] & (world.target[:n] != NOBODY) & (world.layer[:n] != AIR)
    pursue &= ~world.walks[:n] | world.looks_around[:n]
    pursue &= (world.reach[:n] <= MECHANICS.flank_reach) & (world.gap[:n] < MECHANICS.flank_look)
    slots = which(pursue)
    chosen: Ints = slots[~world.walled.take(world.target.take(slots))]
    return chosen


def _kinds(world: World, slots: Ints) -> list[Ints]:
    """Return units apart that differ in owner, size or layer, and in target if they do not choose for themselves."""
    chooses = world.looks_around.take(slots) & world.acquires.take(slots)
    columns = (
        world.owner.take(slots),
        world.layer.take(slots),
        world.separation.take(slots),
        np.where(chooses, ANY, world.target.take(slots)),
    )
    kinds: dict[tuple[float, ...], list[int]] = {}
    for slot, *kind in zip(slots.tolist(), *(column.tolist() for column in columns), strict=True):
        kinds.setdefault(tuple(kind), []).append(slot)
    return [np.array(kind) for kind in kinds.values()]


def _standing(world: World) -> Ints:
    """Return the bodies that may have to be gone round: what does not walk, and is no structure."""
    bodies = world.live
    standing: Ints = bodies[~world.walled.take(bodies) & ~world.wants.take(bodies)]
    return standing


def _foes(world: World, slots: Ints) -> Ints:
    """Return the enemies that are as good as the best target of some units that choose for themselves."""
    best = float(rank_of(world, slots, world.target.take(slots)).max())
    foes = foes_of(world, int(world.owner[slots[0]]))
    foes = foes[~world.walled.take(foes) & ((world.plane_bits.take(foes) & GROUND_PLANE) != 0)]
    rank = rank_of(world, slots[:1], foes)
    chosen: Ints = foes[rank > best - RANK_STEP]
    return chosen


def _follow(world: World, slots: Ints, standing: Ints) -> None:
    """Lead units of one size to the nearest free places in reach of any of their foes."""
    one = int(slots[0])
    chooses = world.looks_around[one] and world.acquires[one]
    foes = _foes(world, slots) if chooses else world.target.take(slots[:1])
    at, width = world.pos.take(slots, 0), float(world.separation[one])
    flow = Flow(pathfinding.surface(world.ground, Layer(int(world.layer[one]))), at)
    bodies = _in_the_way(world, one, standing)
    squeeze = MECHANICS.flank_squeeze
    flow.stand(world.pos.take(bodies, 0), world.separation.take(bodies) + (width - squeeze))
    reach = world.radius.take(foes) + (world.radius.take(slots) + world.reach.take(slots)).min()
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


def _in_the_way(world: World, one: int, standing: Ints) -> Ints:
    """Return the bodies that a unit has to go around: enemies that stand, and friends that fight or hold."""
    bodies = standing[(world.layer_bits.take(standing) & world.layer_bits[one]) != 0]
    busy = (world.target.take(bodies) != NOBODY) | world.holds.take(bodies)
    chosen: Ints = bodies[busy | (world.owner.take(bodies) != world.owner[one])]
    return chosen
