"""Weapons: attacks start when the target is in reach and the weapon is ready, and take effect at the damage point.

The time from one start to the next is the period with a random delay; fractions of a loop carry over while the fight
goes on, so that the mean is exact. What the attack then does, at once, later or by missile, is laid into ``pending``
and ``missiles``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from simulator.arrays import some, which
from simulator.catalog import LOOPS_PER_NORMAL_SECOND
from simulator.stats import GROUND_PLANE, INSTANT_ACCELERATION_N

if TYPE_CHECKING:
    from simulator.columns import Bools, Ints
    from simulator.records import Hit, Weapon
    from simulator.systems.damage import Shot
    from simulator.world import World

NOT_STARTED = -1.0
LARGE_RADIUS = 1.25  # the catalog's validators TargetRadiusSmall and TargetRadiusLarge


def fire(world: World) -> None:
    """Start attacks, let those whose damage point has come take effect, and count down."""
    n = world.top
    cooldown, windup, backswing = world.cooldown[:n], world.windup[:n], world.backswing[:n]
    cooldown -= cooldown > 0.0
    backswing -= backswing > 0.0
    fighters = world.fighters
    if fighters.size:
        started = windup >= 0.0
        if some(started):
            windup -= started
            _drop_lost(world, which(started & ~world.in_reach[:n]))
        ready = world.in_reach.take(fighters)
        ready &= cooldown.take(fighters) <= 0.0
        ready &= ~started.take(fighters)
        if some(ready):
            starting = fighters[ready]
            _start(world, starting[_aimed(world, starting)])
        effective = which((windup <= 0.0) & (windup > NOT_STARTED))
        if effective.size:
            _take_effect(world, effective)
    np.maximum(cooldown, 0.0, out=cooldown)  # a fraction is carried over only into the very next attack


def _drop_lost(world: World, lost: Ints) -> None:
    """Attacks whose target got away before the damage point leave no cooldown."""
    if lost.size:
        world.windup[lost] = NOT_STARTED
        world.cooldown[lost] = 0.0


def _aimed(world: World, slots: Ints) -> Bools:
    """Whether each unit faces its target within its weapon's arc; turrets always do."""
    least = world.aim_cos.take(slots)
    turret = least <= -1.0
    if np.count_nonzero(turret) == len(turret):
        return turret
    along = world.toward.take(slots, 0) * world.heading.take(slots, 0)
    aimed: Bools = turret | (along[:, 0] + along[:, 1] >= least)
    return aimed


def _start(world: World, slots: Ints) -> None:
    """Begin attacks: the cooldown of the next one runs from here."""
    for slot in slots.tolist():
        row = int(world.weapon[slot])
        weapon = world.catalog.weapons[row]
        low, high = weapon.jitter_loops
        delay = low + (high - low) * world.rng.random()
        world.cooldown[slot] += world.stats.period[world.owner[slot], row] + delay
        world.windup[slot] = weapon.damage_point_loops


def _take_effect(world: World, slots: Ints) -> None:
    """Lay the hits of finished attacks into ``pending``, weapon by weapon in the order of their first user."""
    rows = world.weapon[slots]
    owner, target = world.owner[slots], world.target[slots]
    moment = world.loop + world.windup[slots]
    for row in dict.fromkeys(rows.tolist()):
        weapon = world.catalog.weapons[row]
        mine = rows == row
        for index, hit in enumerate(weapon.hits):
            chosen = mine if not hit.when else mine & _branch(world, hit, weapon, target)
            count = int(chosen.sum())
            if count and not is_unmodelled(hit):
                world.pending.append(
                    count,
                    source=slots[chosen],
                    owner=owner[chosen],
                    target=target[chosen],
                    weapon=row,
                    hit=index,
                    due=moment[chosen] + first_delay(hit),
                    single=False,
                    goal=world.pos[target[chosen]],
                    start=world.pos[slots[chosen]],
                )
        world.backswing[slots[mine]] = weapon.backswing_loops
    world.windup[slots] = NOT_STARTED


def first_delay(hit: Hit) -> float:
    """Loops from the damage point until the hit begins."""
    return hit.sweep.points[0][0] if hit.sweep is not None else hit.delay_loops


def is_unmodelled(hit: Hit) -> bool:
    """Whether the rules do not carry out this hit yet: bounces and second circles."""
    return hit.bounce or hit.search is not None


def _branch(world: World, hit: Hit, weapon: Weapon, target: Ints) -> Bools:
    """(k,) whether the game's switch takes the branch ``hit`` stands in; unknown conditions never hold."""
    if hit.when == "else":
        others = [h.when for h in weapon.hits if h.when not in ("", "else")]
        taken = np.zeros(len(target), dtype=np.bool_)
        for name in others:
            taken |= _condition(world, name, target)
        return ~taken
    return _condition(world, hit.when, target)


def _condition(world: World, name: str, target: Ints) -> Bools:
    if name == "GroundUnitFilter":
        on_ground: Bools = (world.plane_bits[target] & GROUND_PLANE) != 0
        return on_ground
    if name in ("TargetRadiusSmall", "TargetRadiusLarge"):
        large: Bools = world.radius[target] >= LARGE_RADIUS
        return large if name == "TargetRadiusLarge" else ~large
    if name == "IsStructure":
        walled: Bools = world.walled[target]
        return walled
    return np.zeros(len(target), dtype=np.bool_)


def launch(world: World, shot: Shot, hit: Hit) -> None:
    """Send the missile of a hit on its way."""
    top = (hit.missile_speed_n or 0.0) / LOOPS_PER_NORMAL_SECOND
    gain_n = hit.missile_acceleration_n
    instant = gain_n is None or gain_n >= INSTANT_ACCELERATION_N
    world.missiles.append(
        1,
        source=shot.source,
        owner=shot.owner,
        target=shot.target,
        weapon=shot.weapon,
        hit=shot.hit,
        start=shot.start,
        goal=shot.goal,
        pos=shot.start,
        step=top if instant else 0.0,
        top=top,
        gain=math.inf if gain_n is None or instant else gain_n / LOOPS_PER_NORMAL_SECOND**2,
    )
