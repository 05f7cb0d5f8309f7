"""Flanking: how melee units that others keep from their targets find another place to fight from.

Those that bodies block follow the flow of ``movement.flow``: round the units that stand, to the nearest free places
from which they reach a target. Units that choose for themselves go for any enemy that is as good as theirs, the others
for their own; ``acquire`` changes the target of a unit that reaches another. So a second row finds the flanks. Ranged
units are left to ``avoidance``. The game's own rule is not known; all of this is an estimate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.movement import flow, grids
from khala_simulator.native import columns, memory
from khala_simulator.systems import acquire
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import GROUND_PLANE
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.movement.flow import Walker
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

LED: Final = 2  # times the side in ``detour`` of those that follow a flow
AIR: Final = int(Layer.AIR)
NO_DISTANCE: Final = 1e-9
REACH: Final = MECHANICS.flank_reach
LOOK: Final = MECHANICS.flank_look
SQUEEZE: Final = MECHANICS.flank_squeeze
CHASE_SLACK: Final = MECHANICS.chase_slack
DETOUR_LOOPS: Final = MECHANICS.detour_loops


def lead(world: World, turning: list[int]) -> None:
    """Write ``aside`` and ``detour`` of those walkers that turn aside, and pursue somebody to whom there is a way."""
    c = columns.columns_of(world)
    pursuers = [slot for slot in turning if _pursues(c, slot)]
    while pursuers:  # those of one kind after the other
        first: int = pursuers[0]
        kind = []
        others = []
        for slot in pursuers:
            if slot == first or _are_alike(c, first, slot):
                kind.append(slot)
            else:
                others.append(slot)
        pursuers = others
        _follow(world, c, kind)


def _pursues(c: Columns, slot: int) -> bool:
    """Return whether a walker is a melee unit near to its target; structures are reached at their walls."""
    return (
        c.target[slot] != NOBODY
        and c.layer[slot] != AIR
        and (not c.walks[slot] or c.looks_around[slot])
        and c.reach[slot] <= REACH
        and c.gap[slot] < LOOK
        and not c.walled[c.target[slot]]
    )


def _chooses(c: Columns, slot: int) -> bool:
    """Return whether a unit chooses its targets for itself."""
    return c.looks_around[slot] and c.acquires[slot]


def _are_alike(c: Columns, slot: int, other: int) -> bool:
    """Return whether two units agree in owner, size and layer, and in target if they do not choose for themselves."""
    return (
        c.owner[slot] == c.owner[other]
        and c.layer[slot] == c.layer[other]
        and c.separation[slot] == c.separation[other]
        and _chooses(c, slot) == _chooses(c, other)
        and (_chooses(c, slot) or c.target[slot] == c.target[other])
    )


def _follow(world: World, c: Columns, kind: list[int]) -> None:
    """Lead units of one kind to the nearest free places in reach of any of their foes."""
    first: int = kind[0]
    walkers = [_walker(c, slot) for slot in kind]
    around = flow.flow_around(grids.grid_of(world.ground, c.layer[first]), walkers)
    width = c.separation[first]
    reach = c.radius[first] + c.reach[first]
    best = 0
    for slot in kind:
        reach = min(reach, c.radius[slot] + c.reach[slot])
        best = max(best, _danger(c, c.target[slot]))
    picks = _chooses(c, first)
    live = world.live
    slots = memory.ints(live)
    for i in range(len(live)):
        slot = slots[i]
        if _is_in_the_way(c, first, slot):
            around.stand(c.pos[slot], c.separation[slot] + (width - SQUEEZE))
        if _is_good(c, first, slot, best) if picks else slot == c.target[first]:
            around.reach(c.pos[slot], max(c.radius[slot] + reach, c.separation[slot] + width) - CHASE_SLACK)
    around.find(walkers, 2.0 * width - SQUEEZE)
    loop: int = world.loop
    for walker in walkers:
        _head_for(c, walker, loop)


def _walker(c: Columns, slot: int) -> Walker:
    return flow.walker_of(slot, c.pos[slot], c.pos[c.target[slot]])


def _head_for(c: Columns, walker: Walker, loop: int) -> None:
    """Have a unit go where the flow leads it, if there is a way."""
    slot = walker.slot
    x = walker.ahead.x - walker.at.x
    y = walker.ahead.y - walker.at.y
    distance = memory.length(x, y)
    if walker.found and distance > 0.0:
        c.aside[slot] = memory.point(x / max(distance, NO_DISTANCE), y / max(distance, NO_DISTANCE))
        c.detour[slot] = -LED if c.detour[slot] < 0 else LED
        c.detour_end[slot] = loop + DETOUR_LOOPS


def _is_in_the_way(c: Columns, first: int, slot: int) -> bool:
    """Return whether a unit has to go around a body: an enemy that stands, or a friend that fights or holds."""
    return (
        not c.walled[slot]
        and not c.wants[slot]
        and c.layer_bits[slot] & c.layer_bits[first] != 0
        and (c.target[slot] != NOBODY or c.holds[slot] or c.owner[slot] != c.owner[first])
    )


def _is_good(c: Columns, first: int, slot: int, best: int) -> bool:
    """Return whether a unit is an enemy that is as good as the best target of its pursuers."""
    return (
        acquire.is_foe(c, c.owner[first], slot)
        and not c.walled[slot]
        and c.plane_bits[slot] & GROUND_PLANE != 0
        and _danger(c, slot) >= best
    )


def _danger(c: Columns, foe: int) -> int:
    """Return the attack priority of a foe, doubled, and 1 more if it fights."""
    fights = c.threat_bits[foe] != 0 and (not c.defensive[foe] or c.target[foe] != NOBODY)
    return 2 * int(c.priority[foe]) + fights
