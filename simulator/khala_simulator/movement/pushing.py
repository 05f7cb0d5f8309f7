"""Pushing: bodies that overlap are pushed apart along the line between their centres, a few times over.

The rules: an idle unit gives way to a friend that comes through, and a unit that fights gives way to friends less than
a walker does. No unit gives way to an enemy, and a unit that holds its place gives way to none. Of two walkers the one
that is nearer to its next corner goes first. Flyers pass through each other and drift apart where they stop. How much
is an estimate (see ``data/mechanics.yaml``).

The steps of one loop, and why they come in this order:

1. ``contacts`` finds the pairs that touch or nearly do. If no two touch, nothing moves.
2. Bodies on the very same point are stirred: they have no line between their centres to part along.
3. The place of each body is kept as ``start``, from which step 7 measures.
4. Flyers that hover drift apart once, by a little, and their pairs are forgotten: they take no part in the rounds.
5. Walkers share out the overlap of each pair, and are pushed in at most ``PUSH_ROUNDS`` rounds, until no overlap is
   left. In one round every pair pushes from where all stood before the round, so no pair gains by its number.
6. Where two are still deep in each other (``OVERLAP_PRESSED``), the one that yields more, or both if they are equal,
   takes its step back; then come one round fewer. Otherwise a crowd with one goal presses itself together.
7. Pushes beyond ``PUSH_LIMIT`` are shortened, so no body jumps.

``share`` and ``rest`` of a pair add up to 1: one round parts a lonely pair, more rounds serve bodies in a row.

To be kept in step by hand: sums of pushes are rounded, so their order decides the last bit of a position. Both places
that add up pushes, the drift and the rounds, choose it by ``crowd.by_slots`` (seconds before firsts among few, firsts
before seconds among many), as ``contacts`` explains.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.movement import contacts
from khala_simulator.native import memory
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.movement.contacts import Crowd
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells

OVERLAP_PRESSED: Final = 0.1
SAME_POINT: Final = 1e-9
STIR: Final = 1e3
IMMOBILE_YIELDING: Final = 1e-6
EVEN: Final = 0.5 - 1e-9
AIR: Final = int(Layer.AIR)
EIGHT_DIRECTIONS: Final = tuple((math.cos(i * math.pi / 4), math.sin(i * math.pi / 4)) for i in range(8))
PUSH_FIRM: Final = MECHANICS.push_firm
PUSH_IDLE: Final = MECHANICS.push_idle
PUSH_RANGED: Final = MECHANICS.push_ranged
PUSH_MELEE: Final = MECHANICS.push_melee
MELEE: Final = MECHANICS.flank_reach
PUSH_AHEAD: Final = MECHANICS.push_ahead
PUSH_LIMIT: Final = MECHANICS.push_limit
PUSH_ROUNDS: Final = MECHANICS.push_rounds
FLYER_DRIFT: Final = MECHANICS.flyer_drift
FLYER_DRIFT_LIMIT: Final = MECHANICS.flyer_drift_limit


def push_apart(crowd: Crowd, c: Columns, slots: Cells) -> bool:
    """Move overlapping bodies apart; return whether any body was touched.

    Walkers that still overlap afterwards take their step back and are pushed from where they stood, so that a crowd
    does not press itself together.
    """
    if not crowd.find_pairs(c, slots):
        return False
    if crowd.closest < SAME_POINT:
        _part(crowd)
    for i in range(crowd.count):
        crowd.start[i] = crowd.after[i]
    drifting = _drift_apart(crowd, c, slots)
    if crowd.pairs:
        _share_out(crowd, c, slots)
        _relax(crowd, PUSH_ROUNDS)
        if _step_back(crowd):
            _relax(crowd, PUSH_ROUNDS - 1)
    _limit(crowd)
    return crowd.pairs > 0 or drifting


def _part(crowd: Crowd) -> None:
    """Give bodies on the very same point a direction to separate in: one of eight, by their numbers."""
    stirred_array = memory.new_bools(crowd.count)
    stirred = memory.bools(stirred_array)
    for k in range(crowd.pairs):
        first = crowd.first[k]
        second = crowd.second[k]
        x = crowd.after[first].x - crowd.after[second].x
        y = crowd.after[first].y - crowd.after[second].y
        if x * x + y * y < SAME_POINT:
            stirred[first] = True
            stirred[second] = True
    for i in range(crowd.count):
        if stirred[i]:
            x, y = EIGHT_DIRECTIONS[i % 8]
            crowd.after[i] = memory.point(
                crowd.after[i].x + x * (1.0 + i) * SAME_POINT * STIR,
                crowd.after[i].y + y * (1.0 + i) * SAME_POINT * STIR,
            )


# flyers ---------------------------------------------------------------------------------------------------------------


def _drift_apart(crowd: Crowd, c: Columns, slots: Cells) -> bool:
    """Separate flyers that hover over each other little by little, and forget their pairs; return whether any did."""
    kept = 0
    for k in range(crowd.pairs):
        if _flies(crowd, c, slots, k):
            _measure_offset(crowd, k)
        else:
            kept += 1
    if kept == crowd.pairs:
        return False
    if crowd.by_slots:
        drifting = _drift_seconds(crowd, c, slots)
        drifting |= _drift_firsts(crowd, c, slots)
    else:
        drifting = _drift_firsts(crowd, c, slots)
        drifting |= _drift_seconds(crowd, c, slots)
    kept = 0
    for k in range(crowd.pairs):
        if not _flies(crowd, c, slots, k):
            crowd.first[kept] = crowd.first[k]
            crowd.second[kept] = crowd.second[k]
            crowd.apart[kept] = crowd.apart[k]
            kept += 1
    crowd.pairs = kept
    return drifting


def _flies(crowd: Crowd, c: Columns, slots: Cells, k: int) -> bool:
    """Return whether one of a pair flies."""
    return AIR in (c.layer[slots[crowd.first[k]]], c.layer[slots[crowd.second[k]]])


def _drift_firsts(crowd: Crowd, c: Columns, slots: Cells) -> bool:
    """Move the first of each pair of flyers away from the second, if it hovers; return whether any overlap."""
    drifting = False
    for k in range(crowd.pairs):
        first = crowd.first[k]
        if _drifts(crowd, c, slots, k, slots[first]):
            drifting |= _drift(crowd, k, first, 1.0)
    return drifting


def _drift_seconds(crowd: Crowd, c: Columns, slots: Cells) -> bool:
    """Do the same with the second of each pair."""
    drifting = False
    for k in range(crowd.pairs):
        second = crowd.second[k]
        if _drifts(crowd, c, slots, k, slots[second]):
            drifting |= _drift(crowd, k, second, -1.0)
    return drifting


def _drifts(crowd: Crowd, c: Columns, slots: Cells, k: int, slot: int) -> bool:
    """Return whether a unit gives way to the other one of a pair of flyers: those on their way pass through."""
    if not _flies(crowd, c, slots, k) or c.wants[slots[crowd.first[k]]] or c.wants[slots[crowd.second[k]]]:
        return False
    return not (c.holds[slot] or c.step_max[slot] <= 0.0)


def _drift(crowd: Crowd, k: int, body: int, sign: float) -> bool:
    """Move a body along the offset of its pair, or against it; return whether the two overlap."""
    distance = memory.length(crowd.offset[k].x, crowd.offset[k].y)
    depth: float = max(crowd.apart[k] - distance, 0.0)
    push = sign * (min(depth * FLYER_DRIFT, FLYER_DRIFT_LIMIT) / max(distance, SAME_POINT))
    _move(crowd.after, body, crowd.offset[k], push)
    return depth > contacts.OVERLAP_ALLOWED


# walkers --------------------------------------------------------------------------------------------------------------


def _share_out(crowd: Crowd, c: Columns, slots: Cells) -> None:
    """Write the shares of an overlap by which the two of each pair give way."""
    for i in range(crowd.count):
        slot = slots[i]
        if c.step_max[slot] <= 0.0 or c.holds[slot]:
            crowd.enemy[i] = crowd.friend[i] = IMMOBILE_YIELDING
        elif c.wants[slot]:
            crowd.enemy[i] = crowd.friend[i] = c.lightness[slot]
        else:
            crowd.enemy[i] = PUSH_FIRM * c.lightness[slot]
            crowd.friend[i] = _standing_yields(c, slot) * c.lightness[slot]
    for k in range(crowd.pairs):
        first = slots[crowd.first[k]]
        second = slots[crowd.second[k]]
        yielding = crowd.friend if c.owner[first] == c.owner[second] else crowd.enemy
        mine = yielding[crowd.first[k]]
        theirs = yielding[crowd.second[k]]
        if c.wants[first] and c.wants[second]:
            left = _squared_distance_left(c, first)
            others_left = _squared_distance_left(c, second)
            if others_left > left:
                mine *= PUSH_AHEAD
            elif others_left < left:
                theirs *= PUSH_AHEAD
        crowd.share[k] = mine / (mine + theirs)
        crowd.rest[k] = theirs / (mine + theirs)


def _standing_yields(c: Columns, slot: int) -> float:
    """Return how easily a friend pushes a unit that stands."""
    if c.target[slot] == NOBODY:
        return PUSH_IDLE
    return PUSH_MELEE if c.reach[slot] <= MELEE else PUSH_RANGED


def _squared_distance_left(c: Columns, slot: int) -> float:
    """Return the square of a unit's distance to its next corner; the nearer unit goes first."""
    x = c.nav_point[slot].x - c.pos[slot].x
    y = c.nav_point[slot].y - c.pos[slot].y
    return x * x + y * y


def _relax(crowd: Crowd, rounds: int) -> None:
    """Push overlapping pairs apart up to so many times, and measure how far apart they are in the end."""
    at = crowd.after
    force = crowd.force
    while True:
        overlapping, deepest = _measure(crowd)
        if rounds == 0 or not deepest > contacts.OVERLAP_ALLOWED:
            return
        rounds -= 1
        for n in range(overlapping):
            k = crowd.chosen[n]
            crowd.push[k] = (crowd.apart[k] - crowd.distance[k]) / max(crowd.distance[k], SAME_POINT)
        for i in range(crowd.count):
            force[i] = memory.point(0.0, 0.0)
        if crowd.by_slots:
            _push_seconds(crowd, overlapping)
            _push_firsts(crowd, overlapping)
        else:
            _push_firsts(crowd, overlapping)
            _push_seconds(crowd, overlapping)
        for i in range(crowd.count):
            at[i] = memory.point(at[i].x + force[i].x, at[i].y + force[i].y)


def _measure(crowd: Crowd) -> tuple[int, float]:
    """Measure the distances of all pairs and choose those that overlap; return how many, and the largest depth."""
    at = crowd.after
    first = crowd.first
    second = crowd.second
    apart = crowd.apart
    chosen = crowd.chosen
    overlapping = 0
    deepest = 0.0
    for k in range(crowd.pairs):  # without a branch, as none could be foreseen
        x = at[first[k]].x - at[second[k]].x
        y = at[first[k]].y - at[second[k]].y
        distance = memory.length(x, y)
        crowd.offset[k] = memory.point(x, y)
        crowd.distance[k] = distance
        chosen[overlapping] = k
        overlapping += apart[k] - distance > 0.0
        deepest = max(deepest, apart[k] - distance)
    return overlapping, deepest


def _measure_offset(crowd: Crowd, k: int) -> None:
    """Write the offset of a pair, from the second to the first."""
    first = crowd.after[crowd.first[k]]
    second = crowd.after[crowd.second[k]]
    crowd.offset[k] = memory.point(first.x - second.x, first.y - second.y)


def _push_firsts(crowd: Crowd, overlapping: int) -> None:
    """Push the first of each chosen pair away from the second."""
    for n in range(overlapping):
        k = crowd.chosen[n]
        _move(crowd.force, crowd.first[k], crowd.offset[k], crowd.push[k] * crowd.share[k])


def _push_seconds(crowd: Crowd, overlapping: int) -> None:
    """Push the second of each chosen pair away from the first."""
    for n in range(overlapping):
        k = crowd.chosen[n]
        _move(crowd.force, crowd.second[k], crowd.offset[k], -(crowd.push[k] * crowd.rest[k]))


def _move(points: memory.Points, i: int, offset: memory.Point, part: float) -> None:
    """Move a point by a part of an offset."""
    points[i] = memory.point(points[i].x + offset.x * part, points[i].y + offset.y * part)


def _step_back(crowd: Crowd) -> bool:
    """Take back the steps of bodies that stay deep in others; return whether any do."""
    deep = False
    for k in range(crowd.pairs):
        if crowd.apart[k] - crowd.distance[k] > OVERLAP_PRESSED:
            deep = True
            if crowd.share[k] >= EVEN:
                _put_back(crowd, crowd.first[k])
            if crowd.rest[k] >= EVEN:
                _put_back(crowd, crowd.second[k])
    return deep


def _put_back(crowd: Crowd, body: int) -> None:
    """Put a body where it stood before its step."""
    crowd.after[body] = crowd.before[body]
    crowd.start[body] = crowd.before[body]


def _limit(crowd: Crowd) -> None:
    """Shorten pushes that are too far for one loop."""
    limited = False
    for i in range(crowd.count):
        x = crowd.after[i].x - crowd.start[i].x
        y = crowd.after[i].y - crowd.start[i].y
        limited |= memory.length(x, y) > PUSH_LIMIT
    if not limited:
        return
    for i in range(crowd.count):
        start = crowd.start[i]
        x = crowd.after[i].x - start.x
        y = crowd.after[i].y - start.y
        part = min(1.0, PUSH_LIMIT / max(memory.length(x, y), 1e-12))
        crowd.after[i] = memory.point(start.x + x * part, start.y + y * part)
