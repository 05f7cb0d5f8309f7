"""Engagement: the distance of every fight, and where every unit wants to be this loop.

Between choosing targets (``acquire``, orders) and acting on them (``weapons``, ``movement``). Writes the columns
``gap``, ``toward``, ``in_reach``, ``wants``, ``goal`` and ``stop_at``, which later systems of the same loop read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.abilities import casting
from khala_simulator.economy.harvesting import Phase, reach_of
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some, which
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.casts import Cast
from khala_simulator.world.census import census
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.world.columns import Bools, Floats, Ints
    from khala_simulator.world.world import World

EDGE_TOLERANCE = 1e-9
ON_TARGET = 1e-9
ARMS_LENGTH = 0.5
"""Weapons that reach no farther hit structures at their walls."""
BESIDE_WALLS = 0.5
"""Distance at which the ways of small units pass a wall."""
FOLLOW_GAP = 0.5
HARVEST_OVERLAP = 0.01
"""How far inside its reach a worker brakes to a stop. The last stretch is slow: 0.05 would save four loops a trip."""
FOLLOW = int(OrderKind.FOLLOW)
TO_RESOURCE, TO_HALL = int(Phase.TO_RESOURCE), int(Phase.TO_HALL)


def measure(world: World) -> None:
    """Measure the distance of every fight and write which units want to walk where."""
    n = world.top
    target = world.target[:n]
    fighters = world.fighters = which(target >= 0)
    wants = world.wants[:n]
    np.copyto(wants, world.walks[:n])
    np.copyto(world.goal[:n], world.order_point[:n])
    world.stop_at[:n] = 0.0
    world.in_reach[:n] = False
    if some(world.needs_target[:n]):
        _follow(world)
    if some(world.casts[:n]):
        approach(world)
    if world.harvesting:
        _haul(world)
    if some(world.returning[:n]):
        _go_back(world)
    if fighters.size:
        _close_in(world, fighters)
    if some(wants):
        free = world.windup[:n] < 0.0
        free &= world.backswing[:n] <= 0.0
        if census(world).rolling_guns:
            free |= world.rolling[:n]
        wants &= free
        wants &= world.step_max[:n] > 0.0


def _close_in(world: World, slots: Ints) -> None:
    """Write the distances, goals and reach of the units that fight."""
    target = world.target.take(slots)
    goal = world.pos.take(target, 0)
    offset = goal - world.pos.take(slots, 0)
    distance = geometry.length(offset)
    on_target = distance < ON_TARGET
    if some(on_target):
        offset[on_target] = world.heading[slots[on_target]]
        distance = np.where(on_target, 1.0, distance)
    world.toward[slots] = offset / distance[:, None]
    bodies = world.radius.take(slots) + world.radius.take(target)
    gap = np.where(on_target, 0.0, distance) - bodies
    reach = world.reach.take(slots)
    close = world.walled.take(target) & (reach <= ARMS_LENGTH)
    if some(close):
        gap[close] = np.minimum(gap[close], _to_walls(world, slots[close], target[close]))
    swinging = world.windup.take(slots) >= 0.0
    kinds = census(world)
    if kinds.beams:
        swinging |= world.beaming.take(slots)
    allowed = reach + EDGE_TOLERANCE
    beyond = gap > allowed
    near = ~beyond
    if some(swinging):
        near |= swinging & (gap <= reach + world.slop.take(slots))
    near &= gap >= world.reach_min.take(slots)
    near &= world.can_attack.take(slots)
    if world.fog or world.hiding:
        near &= world.visible[world.owner.take(slots), target]
    if world.area_effects:
        near &= inside_zone(world, slots, target)
    if kinds.beams:
        world.beaming[slots] &= near
    world.gap[slots] = gap
    world.in_reach[slots] = near
    beyond &= ~near | world.rolling.take(slots) if kinds.rolling_guns else ~near
    beyond &= ~world.holds.take(slots)
    if kinds.guns_walking:
        rest = which(~world.walks.take(slots) | world.looks_around.take(slots))
        if len(rest) < len(slots):  # a unit that fires while it walks stays on its way
            slots, goal, bodies = slots[rest], goal[rest], bodies[rest]
            reach, beyond = reach[rest], beyond[rest]
    world.goal[slots] = goal
    world.stop_at[slots] = bodies + np.maximum(reach - MECHANICS.chase_slack, 0.0)
    world.wants[slots] = beyond


def _to_walls(world: World, slots: Ints, targets: Ints) -> Floats:
    """Return (k,) the distances from edges of units to walls of structures, which may keep the middle out of reach."""
    beside = np.abs(world.pos.take(slots, 0) - world.pos.take(targets, 0)) - world.walls.take(targets, 0)
    return geometry.length(np.maximum(beside, 0.0)) - np.maximum(world.radius.take(slots), BESIDE_WALLS)


def inside_zone(world: World, slots: Ints, targets: Ints) -> Bools:
    """Return (k,) whether each target touches the only circle in which the unit fires; most units fire anywhere."""
    radius = world.zone_radius.take(slots)
    offset = world.pos.take(targets, 0) - world.zone.take(slots, 0)
    inside: Bools = geometry.length(offset) <= radius + world.radius.take(targets)
    return inside | (radius <= 0.0)


def _follow(world: World) -> None:
    """Make units that follow another one walk until they are beside it."""
    n = world.top
    following = world.order_kind[:n] == FOLLOW
    if some(following):
        slots = which(following & (world.order_target[:n] >= 0))
        leader = world.order_target.take(slots)
        goal = world.pos.take(leader, 0)
        offset = goal - world.pos.take(slots, 0)
        stop_at = world.separation.take(slots) + world.separation.take(leader) + FOLLOW_GAP
        world.goal[slots] = goal
        world.stop_at[slots] = stop_at
        world.wants[slots] = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) > stop_at + FOLLOW_GAP


def _haul(world: World) -> None:
    """Make workers walk until they are at their resource or town hall."""
    n = world.top
    phase = world.harvest[:n]
    slots = which(((phase == TO_RESOURCE) | (phase == TO_HALL)) & (world.order_target[:n] >= 0))
    if slots.size:
        place = world.order_target.take(slots)
        goal = world.pos.take(place, 0)
        offset = goal - world.pos.take(slots, 0)
        stop_at = reach_of(world, slots, place)
        world.goal[slots] = goal
        world.stop_at[slots] = stop_at - HARVEST_OVERLAP
        world.wants[slots] = offset[:, 0] ** 2 + offset[:, 1] ** 2 > stop_at * stop_at


def approach(world: World) -> None:
    """Make casters walk until their ability reaches, and stand from then on unless they have to follow."""
    for slot in which(world.casts[: world.top]).tolist():
        target = int(world.order_target[slot])
        ability = casting.as_is(world, slot, world.catalog.ability(int(world.order_ability[slot])))
        aimed = target != NOBODY or bool(world.order_aimed[slot])
        waits = world.cast_at[slot] < 0.0 and not world.channels[slot]
        follows = bool(world.channels[slot]) and ability.follow_range > 0.0
        if not (aimed and (waits or follows)) or ability.range >= casting.ANYWHERE:
            continue
        goal = world.pos[target] if target != NOBODY else world.order_point[slot]
        body = float(world.radius[target]) if target != NOBODY else 0.0
        if follows:
            stop_at = ability.follow_range + float(world.radius[slot]) + body
        else:
            stop_at = casting.reach(world, Cast(slot, ability, target))
        dx, dy = (goal - world.pos[slot]).tolist()
        world.goal[slot] = goal
        world.stop_at[slot] = max(stop_at - MECHANICS.chase_slack, 0.0)
        world.wants[slot] = dx * dx + dy * dy > stop_at * stop_at


def _go_back(world: World) -> None:
    """Send idle units back to where they stood before a fight; once there, they forget that place."""
    n = world.top
    slots = which(world.returning[:n] & (world.target[:n] == NOBODY))
    if slots.size:
        offset = world.guard[slots] - world.pos[slots]
        away = offset[:, 0] ** 2 + offset[:, 1] ** 2 > MECHANICS.guard_slack**2
        world.returning[slots] = world.wants[slots] = away
        world.goal[slots] = world.guard[slots]
