"""Damage: what a hit takes from whom.

A hit on a unit takes the damage, with its bonus against the unit's attributes, less armor, at least 0.5: from the
shields first, with the shields' armor, and what they do not hold from life, with the body's. Splash takes its ring's
fraction before armor. The formula's source is in ``data/SOURCES.md``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from simulator import geometry
from simulator.arrays import some
from simulator.columns import NOBODY
from simulator.mechanics import MECHANICS
from simulator.stats import AIR_PLANE, GROUND_PLANE
from simulator.systems import weapons

if TYPE_CHECKING:
    from simulator.columns import Bools, Ints
    from simulator.records import Affects, Sweep
    from simulator.stats import Damage
    from simulator.world import World

BEHIND = 1e-9


class Shot(NamedTuple):
    """One row of ``shots`` as Python values."""

    source: int
    owner: int
    target: int
    weapon: int
    hit: int
    start: tuple[float, float]
    goal: tuple[float, float]


def shot_of(row: np.void) -> Shot:
    """The shot in a row of either table of ``shots``."""
    source, owner, target, weapon, hit = (int(row[name]) for name in Shot._fields[:5])
    start, goal = row["start"].tolist(), row["goal"].tolist()
    return Shot(source, owner, target, weapon, hit, (start[0], start[1]), (goal[0], goal[1]))


def deal_pending(world: World) -> None:
    """Let every hit that is due happen, in the order of being fired; those of a dead attacker are lost."""
    pending = world.pending
    if not len(pending):
        return
    due = pending.rows["due"] <= world.loop
    if not some(due):
        return
    alive = pending.target != NOBODY
    pending.rows["goal"] = np.where(alive[:, None], world.pos.take(pending.target, 0), pending.goal)
    rows = pending.rows[due]
    pending.keep(~due)
    for row, begun, single in zip(rows, rows["due"].tolist(), rows["single"].tolist(), strict=True):
        shot = shot_of(row)
        if shot.source == NOBODY:
            continue
        hit = world.catalog.weapons[shot.weapon].hits[shot.hit]
        if single:
            _hit_target(world, shot, world.stats.damage[shot.owner][shot.weapon][shot.hit])
        elif hit.missile_speed_n is not None:
            weapons.launch(world, shot, hit)
        elif hit.sweep is not None:
            _sweep(world, shot, hit.sweep, begun)
        else:
            hit_with(world, shot)


def hit_with(world: World, shot: Shot) -> None:
    """Carry out one hit: on its target, and in the rings around it."""
    damage = world.stats.damage[shot.owner][shot.weapon][shot.hit]
    if damage.hit.area:
        _splash(world, shot, damage)
        if not damage.hit.area_affects.not_target:
            return
    _hit_target(world, shot, damage)
    if damage.hit.kills_self and shot.source != NOBODY:
        world.life[shot.source] = 0.0


def _hit_target(world: World, shot: Shot, damage: Damage) -> None:
    if shot.target != NOBODY:
        strike(world, shot.source, shot.owner, shot.target, damage)


def strike(world: World, source: int, owner: int, victim: int, damage: Damage, fraction: float = 1.0) -> None:
    """Take one hit's damage from one unit and count it in both players' scores."""
    row, side = int(world.type[victim]), int(world.owner[victim])
    if not world.targetable[victim] or world.life[victim] <= 0.0:
        return
    amount = damage.against(int(world.stats.attribute_bits[row])) * fraction
    pierces = damage.hit.ignores_armor
    shield_armor = 0.0 if pierces else float(world.stats.shield_armor[side, row])
    armor = 0.0 if pierces else float(world.stats.armor[side, row])
    shields, life = float(world.shields[victim]), float(world.life[victim])
    absorbed, rest = 0.0, amount
    if shields > 0.0:
        reduced = max(amount - shield_armor, MECHANICS.damage_min)
        absorbed = min(shields, reduced)
        rest = reduced - absorbed
    wounded = min(life, max(rest - armor, MECHANICS.damage_min)) if rest > 0.0 else 0.0
    world.shields[victim] = shields - absorbed
    world.life[victim] = life - wounded
    world.damaged_loop[victim] = world.loop
    taken = world.players[side].score.damage_taken
    taken.shields += absorbed
    taken.life += wounded
    if owner != side:
        dealt = world.players[owner].score.damage_dealt
        dealt.shields += absorbed
        dealt.life += wounded
    if source != NOBODY:
        world.attacker[victim] = source
        world.hurt.append((victim, source))


def _splash(world: World, shot: Shot, damage: Damage) -> None:
    """Damage everybody in the rings around the impact, each with the fraction of the innermost ring it is in."""
    hit = damage.hit
    near = _affected(world, hit.area_affects, shot)
    offset = world.pos[near] - shot.goal
    edge = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) - world.radius[near]
    forward = (shot.goal[0] - shot.start[0], shot.goal[1] - shot.start[1])
    for slot, distance, (x, y) in zip(near.tolist(), edge.tolist(), offset.tolist(), strict=True):
        for ring in hit.area:
            if distance <= ring.radius and _in_arc(x, y, *forward, ring.arc_deg):
                strike(world, shot.source, shot.owner, slot, damage, ring.fraction)
                break


def _in_arc(x: float, y: float, forward_x: float, forward_y: float, arc_deg: float) -> bool:
    """Whether an offset lies within half an arc of the direction of the shot."""
    if arc_deg >= 360.0:
        return True
    along = x * forward_x + y * forward_y
    lengths = np.sqrt((x * x + y * y) * (forward_x * forward_x + forward_y * forward_y))
    return bool(along >= np.cos(np.radians(arc_deg / 2.0)) * lengths - BEHIND)


def _sweep(world: World, shot: Shot, sweep: Sweep, begun: float) -> None:
    """Lay a single hit for everybody on the line, at the delay of the first point that touches it.

    Whom the line touches is decided once, when it begins at the (fractional) loop ``begun``.
    """
    forward_x, forward_y = shot.goal[0] - shot.start[0], shot.goal[1] - shot.start[1]
    distance = math.sqrt(forward_x * forward_x + forward_y * forward_y)
    fx, fy = (forward_x / distance, forward_y / distance) if distance > BEHIND else (0.0, -1.0)
    near = _affected(world, sweep.affects, shot)
    points = np.array(sweep.points)
    across, along = points[:, 1], points[:, 2]
    at = shot.goal + np.stack([across * fy - along * fx, -across * fx - along * fy], axis=1)
    offset = world.pos[near][:, None, :] - at
    touched: Bools = geometry.length(offset) <= sweep.radius + world.radius[near][:, None]
    hits: Ints = np.flatnonzero(touched.any(axis=1))
    if hits.size:
        first = np.argmax(touched[hits], axis=1)
        world.pending.append(
            len(hits),
            source=shot.source,
            owner=shot.owner,
            target=near[hits],
            weapon=shot.weapon,
            hit=shot.hit,
            start=shot.start,
            goal=world.pos[near[hits]],
            due=begun - points[0, 0] + points[first, 0],
            single=True,
        )


def _affected(world: World, affects: Affects, shot: Shot) -> Ints:
    """Living units that a splash or a sweep may touch."""
    slots = world.live
    chosen = world.targetable[slots] & (world.life[slots] > 0.0)
    if not affects.allies:
        chosen &= world.owner[slots] != shot.owner
    if affects.plane != "any":
        bit = GROUND_PLANE if affects.plane == "ground" else AIR_PLANE
        chosen &= (world.plane_bits[slots] & bit) != 0
    if affects.only == "structure":
        chosen &= world.walled[slots]
    if affects.excluding == "structure":
        chosen &= ~world.walled[slots]
    if affects.not_self:
        chosen &= slots != shot.source
    if affects.not_target:
        chosen &= slots != shot.target
    found: Ints = slots[chosen]
    return found
