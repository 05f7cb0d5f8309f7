"""Engagement: who fights whom with which weapon, how far away it is, and where everybody wants to be this loop.

Between choosing targets (``acquire``, orders) and acting on them (``weapons``, ``movement``). Writes the columns
``gap``, ``in_reach``, ``wants``, ``goal`` and ``stop_at``, which the later systems of the same loop read.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from simulator.mechanics import MECHANICS
from simulator.orders import OrderKind
from simulator.stats import GROUND_PLANE
from simulator.world import NOBODY

if TYPE_CHECKING:
    from simulator.world import Bools, World

WIDEST_AIM_DEG = 180.0
EDGE_TOLERANCE = 1e-9
FOLLOW_GAP = 0.5


def engage(world: World, slot: int, target: int) -> bool:
    """Make a unit fight ``target`` with the weapon that fits; False when it has none."""
    on_ground = bool(world.plane_bits[target] & GROUND_PLANE)
    row = int(world.ground_weapon[slot]) if on_ground else -1
    if row < 0 and (not on_ground or world.plane_bits[target] != GROUND_PLANE):
        row = int(world.air_weapon[slot])
    if row < 0:
        return False
    if world.target[slot] != target:
        drop_attack(world, slot)
    weapon = world.catalog.weapons[row]
    world.target[slot] = target
    world.weapon[slot] = row
    world.reach[slot] = world.stats.range[world.owner[slot], row]
    world.reach_min[slot] = weapon.min_range
    world.slop[slot] = weapon.slop
    turns = weapon.turret_deg_n is None and not world.unit_type(slot).unturnable
    angle = min(weapon.arc_deg / 2.0 + weapon.arc_slop_deg, WIDEST_AIM_DEG)
    world.aim_cos[slot] = math.cos(math.radians(angle)) if turns else -1.0
    world.nav_loop[slot] = 0
    return True


def disengage(world: World, slot: int) -> None:
    """Make a unit stop fighting; what it has fired stays on its way."""
    drop_attack(world, slot)
    world.target[slot] = NOBODY
    world.weapon[slot] = -1
    world.nav_loop[slot] = 0


def drop_attack(world: World, slot: int) -> None:
    """Drop an attack that is started and has not taken effect; it leaves no cooldown."""
    if world.windup[slot] >= 0.0:
        world.windup[slot] = -1.0
        world.cooldown[slot] = 0.0


def measure(world: World) -> None:
    """Measure the distance of every fight and say who wants to walk where."""
    n = world.top
    kind, target = world.order_kind[:n], world.target[:n]
    fighting = target != NOBODY
    goal = world.goal[:n]
    np.copyto(goal, world.order_point[:n])
    wants = (kind == OrderKind.MOVE) | (kind == OrderKind.ATTACK_MOVE)
    stop_at = world.stop_at[:n]
    stop_at.fill(0.0)
    if (kind >= OrderKind.PATROL).any():
        wants |= kind >= OrderKind.PATROL
    if (kind == OrderKind.FOLLOW).any():
        wants |= _follow(world)
    if world.returning[:n].any():
        wants |= _go_back(world)
    world.in_reach[:n] = False
    if fighting.any():
        _close_in(world)
        np.copyto(wants, (world.gap[:n] > world.reach[:n]) & (kind != OrderKind.HOLD), where=fighting)
    wants &= (world.windup[:n] < 0.0) & (world.backswing[:n] <= 0.0) & (world.step_max[:n] > 0.0)
    world.wants[:n] = wants


def _close_in(world: World) -> None:
    """Distances, goals and reach of the units that fight."""
    slots = np.flatnonzero(world.target[: world.top] != NOBODY)
    target = world.target[slots]
    goal = world.pos[target]
    offset = goal - world.pos[slots]
    bodies = world.radius[slots] + world.radius[target]
    gap = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) - bodies
    reach = world.reach[slots]
    allowed = reach + np.where(world.windup[slots] >= 0.0, world.slop[slots], EDGE_TOLERANCE)
    world.gap[slots] = gap
    world.in_reach[slots] = (gap <= allowed) & (gap >= world.reach_min[slots])
    world.goal[slots] = goal
    world.stop_at[slots] = bodies + np.maximum(reach - MECHANICS.chase_slack, 0.0)


def _follow(world: World) -> Bools:
    """(top,) units that follow another one and are not beside it yet."""
    n = world.top
    following: Bools = (world.order_kind[:n] == OrderKind.FOLLOW) & (world.order_target[:n] != NOBODY)
    slots = np.flatnonzero(following)
    leader = world.order_target[slots]
    offset = world.pos[leader] - world.pos[slots]
    world.goal[slots] = world.pos[leader]
    world.stop_at[slots] = world.separation[slots] + world.separation[leader] + FOLLOW_GAP
    following[slots] = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) > world.stop_at[slots] + FOLLOW_GAP
    return following


def _go_back(world: World) -> Bools:
    """(top,) idle units that are away from where they stood before a fight; the others forget that place."""
    n = world.top
    back = world.returning[:n] & (world.target[:n] == NOBODY) & (world.order_kind[:n] == OrderKind.IDLE)
    offset = world.guard[:n] - world.pos[:n]
    away = offset[:, 0] ** 2 + offset[:, 1] ** 2 > MECHANICS.guard_slack**2
    world.returning[:n] &= ~(back & ~away)
    going: Bools = back & away
    world.goal[:n][going] = world.guard[:n][going]
    return going
