"""Damage: what a hit takes from whom.

A hit on a unit takes the damage, with its bonus against the unit's attributes, less armor, at least 0.5: from the
shields first, with the shields' armor, and what they do not hold from life, with the body's. Splash takes its ring's
fraction before armor. The formula's source is in ``data/SOURCES.md``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator.mechanics import MECHANICS
from simulator.stats import AIR_PLANE, GROUND_PLANE
from simulator.systems import weapons
from simulator.world import NOBODY

if TYPE_CHECKING:
    from simulator.records import Affects, Sweep
    from simulator.shots import Missiles, PendingHits
    from simulator.stats import Damage
    from simulator.world import Ints, World

BEHIND = 1e-9


def deal_pending(world: World) -> None:
    """Let every hit that is due happen, in the order of being fired."""
    pending = world.pending
    if not len(pending):
        return
    due = pending.due <= world.loop
    if not due.any():
        return
    alive = pending.target != NOBODY
    pending.goal[alive] = world.pos[pending.target[alive]]
    for shot in np.flatnonzero(due).tolist():
        hit = world.catalog.weapons[int(pending.weapon[shot])].hits[int(pending.hit[shot])]
        orphan = pending.source[shot] == NOBODY
        if orphan:
            continue
        if hit.missile_speed_n is not None and not pending.single[shot]:
            weapons.launch(world, shot)
        else:
            hit_with(world, pending, shot)
    late = len(due)  # sweeps lay their single hits behind the rows looked at
    keep = np.ones(len(pending), dtype=np.bool_)
    keep[:late] = ~due
    pending.keep(keep)


def hit_with(world: World, shots: Missiles | PendingHits, shot: int) -> None:
    """Carry out one hit: on its target, on the ring around it, or along a sweep."""
    source, owner, target = int(shots.source[shot]), int(shots.owner[shot]), int(shots.target[shot])
    row, index = int(shots.weapon[shot]), int(shots.hit[shot])
    damage = world.stats.damage[owner][row][index]
    hit = damage.hit
    single = shots is world.pending and bool(world.pending.single[shot])
    if hit.sweep is not None and not single:
        _sweep(world, world.pending, shot, hit.sweep)
        return
    if hit.area and not single:
        _splash(world, shots, shot, damage)
        if not hit.area_affects.not_target:
            return
    if target != NOBODY:
        strike(world, source, owner, target, damage)
    if hit.kills_self and source != NOBODY:
        world.life[source] = 0.0


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
    taken, dealt = world.players[side].score.damage_taken, world.players[owner].score.damage_dealt
    for counter in (taken, dealt):
        counter.shields += absorbed
        counter.life += wounded
    if source != NOBODY:
        world.attacker[victim] = source
        world.hurt.append((victim, source))


def _splash(world: World, shots: Missiles | PendingHits, shot: int, damage: Damage) -> None:
    """Damage everybody in the rings around the impact, each with the fraction of the innermost ring it is in."""
    hit = damage.hit
    source, owner, target = int(shots.source[shot]), int(shots.owner[shot]), int(shots.target[shot])
    near = _affected(world, hit.area_affects, source, owner, target)
    offset = world.pos[near] - shots.goal[shot]
    edge = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) - world.radius[near]
    forward = shots.goal[shot] - shots.start[shot]
    for slot, distance, (x, y) in zip(near.tolist(), edge.tolist(), offset.tolist(), strict=True):
        for ring in hit.area:
            if distance <= ring.radius and _in_arc(x, y, forward[0], forward[1], ring.arc_deg):
                strike(world, source, owner, slot, damage, ring.fraction)
                break


def _in_arc(x: float, y: float, forward_x: float, forward_y: float, arc_deg: float) -> bool:
    """Whether an offset lies within half an arc of the direction of the shot."""
    if arc_deg >= 360.0:
        return True
    along = x * forward_x + y * forward_y
    lengths = np.sqrt((x * x + y * y) * (forward_x * forward_x + forward_y * forward_y))
    return bool(along >= np.cos(np.radians(arc_deg / 2.0)) * lengths - BEHIND)


def _sweep(world: World, pending: PendingHits, shot: int, sweep: Sweep) -> None:
    """Lay a single hit for everybody on the line, at the delay of the first point that touches it.

    Whom the line touches is decided once, when it begins.
    """
    source, owner, target = int(pending.source[shot]), int(pending.owner[shot]), int(pending.target[shot])
    goal, start = pending.goal[shot], pending.start[shot]
    forward = goal - start
    distance = float(np.sqrt(forward[0] ** 2 + forward[1] ** 2))
    fx, fy = (forward / distance).tolist() if distance > BEHIND else (0.0, -1.0)
    near = _affected(world, sweep.affects, source, owner, target)
    points = np.array(sweep.points)
    across, along = points[:, 1], points[:, 2]
    at = goal + np.stack([across * fy - along * fx, -across * fx - along * fy], axis=1)
    offset = world.pos[near][:, None, :] - at
    touched = np.sqrt(offset[..., 0] ** 2 + offset[..., 1] ** 2) <= sweep.radius + world.radius[near][:, None]
    hits = np.flatnonzero(touched.any(axis=1))
    if hits.size:
        first = np.argmax(touched[hits], axis=1)
        begun = pending.due[shot] - points[0, 0]
        pending.append(
            len(hits),
            source=source,
            owner=owner,
            target=near[hits],
            weapon=pending.weapon[shot],
            hit=pending.hit[shot],
            due=begun + points[first, 0],
            single=True,
            goal=world.pos[near[hits]],
            start=start,
        )


def _affected(world: World, affects: Affects, source: int, owner: int, target: int) -> Ints:
    """Living units that a splash or a sweep may touch."""
    slots = world.live
    chosen = world.targetable[slots] & (world.life[slots] > 0.0)
    if not affects.allies:
        chosen &= world.owner[slots] != owner
    if affects.plane != "any":
        bit = GROUND_PLANE if affects.plane == "ground" else AIR_PLANE
        chosen &= (world.plane_bits[slots] & bit) != 0
    if affects.only == "structure":
        chosen &= world.walled[slots]
    if affects.excluding == "structure":
        chosen &= ~world.walled[slots]
    if affects.not_self:
        chosen &= slots != source
    if affects.not_target:
        chosen &= slots != target
    found: Ints = slots[chosen]
    return found
