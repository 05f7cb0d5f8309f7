"""Damage: what a hit takes from which unit.

A hit on a unit takes the damage, with its bonus against the unit's attributes, less armor, at least 0.5: from the
shields first, with the shields' armor, and the rest from life, with the body's. Splash takes its ring's fraction before
armor. The formula's source is in ``data/SOURCES.md``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import AIR_PLANE, GROUND_PLANE
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.tables.records import Affects, Search
    from khala_simulator.tables.stats import Damage
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.shots import Shot
    from khala_simulator.world.world import World

BEHIND = 1e-9

IMPACTS: Final[dict[str, Callable[[World, int, int, int], None]]] = {}
"""What a hit does to its target in addition to its damage, by the hit's effect: a function of the world, the attacker
(a slot or NOBODY), its owner and the target."""


def hit_with(world: World, shot: Shot) -> None:
    """Carry out one hit: on its target, in the rings around it, or on the units that a second search finds."""
    damage = world.stats.damage[shot.owner][shot.weapon][shot.hit]
    if damage.hit.kills_self:
        _give_life(world, shot.source)
    elif damage.hit.search is not None and not damage.hit.bounce:
        for slot in found_by(world, damage.hit.search, shot):
            strike(world, shot.source, shot.owner, slot, damage)
    elif damage.hit.area:
        _splash(world, shot, damage)
        if damage.hit.area_affects.not_target:
            hit_target(world, shot)
    else:
        hit_target(world, shot)


def hit_target(world: World, shot: Shot) -> None:
    """Carry out a hit on its target alone, if that still lives."""
    if shot.target == NOBODY:
        return
    damage = world.stats.damage[shot.owner][shot.weapon][shot.hit]
    if damage.hit.effect in IMPACTS:
        IMPACTS[damage.hit.effect](world, shot.source, shot.owner, shot.target)
    strike(world, shot.source, shot.owner, shot.target, damage)


def _give_life(world: World, slot: int) -> None:
    """Kill a unit by its own attack; no player gets the credit."""
    if slot != NOBODY:
        world.life[slot] = 0.0
        world.spent[slot] = True
        world.attacker[slot] = NOBODY


def strike(world: World, source: int, owner: int, victim: int, damage: Damage, fraction: float = 1.0) -> None:
    """Take one hit's damage from one unit and count it in both players' scores."""
    attributes = int(world.stats.attribute_bits[world.type[victim]])
    amount = damage.against(attributes) * fraction
    kind = "splash" if fraction < 1.0 else damage.hit.kind
    if source != NOBODY:
        if world.bonus_bits[source] & attributes:
            amount += float(world.bonus_add[source]) * fraction
        amount *= float(world.dealt_factor[source])
    apply_damage(world, source, owner, victim, amount, kind=kind, ignores_armor=damage.hit.ignores_armor)


def apply_damage(
    world: World,
    source: int,
    owner: int,
    victim: int,
    amount: float,
    *,
    kind: str = "spell",
    ignores_armor: bool = True,
    shield_bonus: float = 0.0,
) -> None:
    """Take an amount of damage from one unit: shields first, then life; both players' scores count it.

    Args:
        world: The game.
        source: Slot of the unit that deals it, or NOBODY.
        owner: Whose damage it is.
        victim: Slot of the unit that takes it; one that can't be touched takes none.
        amount: Before armor, bonuses included.
        kind: ``ranged``, ``melee``, ``splash`` or ``spell``; buffs depend on it.
        ignores_armor: Whether armor does not count.
        shield_bonus: More damage that only shields take.
    """
    if not world.targetable[victim] or world.life[victim] <= 0.0 or amount <= 0.0 >= shield_bonus:
        return
    row, side = int(world.type[victim]), int(world.owner[victim])
    answer = world.ranged_add if kind == "ranged" else world.melee_add if kind == "melee" else None
    if answer is not None and answer[victim]:
        amount = max(amount + float(answer[victim]), MECHANICS.damage_min)
    amount *= float(world.taken_factor[victim])
    if source != NOBODY and kind != "spell" and world.plane_bits[source] & AIR_PLANE:
        amount *= float(world.air_taken_factor[victim])
    if world.barrier[victim] > 0.0:
        held = min(float(world.barrier[victim]), amount)
        world.barrier[victim] -= held
        amount -= held
    shield_armor = 0.0 if ignores_armor else float(world.stats.shield_armor[side, row] + world.shield_armor_add[victim])
    armor = 0.0 if ignores_armor else float(world.stats.armor[side, row] + world.armor_add[victim])
    shields, life = float(world.shields[victim]), float(world.life[victim])
    least = MECHANICS.damage_min if amount > 0.0 else 0.0
    absorbed, rest = 0.0, amount
    if shields > 0.0:
        reduced = max(amount + shield_bonus - shield_armor, least)
        absorbed = min(shields, reduced)
        rest = max(min(reduced, amount) - absorbed, 0.0)
    wounded = min(life, max(rest - armor, least)) if rest > 0.0 else 0.0
    world.shields[victim] = shields - absorbed
    world.life[victim] = life - wounded
    world.damaged_loop[victim] = world.loop
    _count(world, owner, side, absorbed, wounded)
    if source != NOBODY:
        world.attacker[victim] = source
        world.hurt.append((victim, source))


def _count(world: World, owner: int, side: int, absorbed: float, wounded: float) -> None:
    taken = world.players[side].score.damage_taken
    taken.shields += absorbed
    taken.life += wounded
    if owner != side:
        dealt = world.players[owner].score.damage_dealt
        dealt.shields += absorbed
        dealt.life += wounded


def _splash(world: World, shot: Shot, damage: Damage) -> None:
    """Damage every unit in the rings around the impact, with the fraction of its innermost ring."""
    hit = damage.hit
    near = affected(world, hit.area_affects, shot)
    offset = world.pos[near] - shot.goal
    edge = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) - world.radius[near]
    forward = (shot.goal[0] - shot.start[0], shot.goal[1] - shot.start[1])
    bodies = zip(near.tolist(), edge.tolist(), world.radius[near].tolist(), offset.tolist(), strict=True)
    for slot, distance, radius, (x, y) in bodies:
        for ring in hit.area:
            if distance <= ring.radius and in_arc(x, y, radius, *forward, ring.arc_deg):
                strike(world, shot.source, shot.owner, slot, damage, ring.fraction)
                break


def in_arc(x: float, y: float, radius: float, forward_x: float, forward_y: float, arc_deg: float) -> bool:
    """Return whether a body touches the sector of an arc, at most 180 degrees or all round, in the shot's direction."""
    if arc_deg >= 360.0:
        return True
    length = math.hypot(forward_x, forward_y)
    along, across = x * forward_x + y * forward_y, abs(x * forward_y - y * forward_x)
    cosine, sine = math.cos(math.radians(arc_deg / 2.0)), math.sin(math.radians(arc_deg / 2.0))
    beyond = across * cosine - along * sine <= (radius + BEHIND) * length  # from the edge of the sector
    return (beyond and along * cosine + across * sine >= 0.0) or math.hypot(x, y) <= radius


def found_by(world: World, search: Search, shot: Shot) -> list[int]:
    """Return the slots that a second search finds, nearest first; from the source the radius counts from the edge.

    The unit that the shot bounced from is not found again.
    """
    near = affected(world, search.affects, shot)
    forward = (shot.goal[0] - shot.start[0], shot.goal[1] - shot.start[1])
    radius, origin = search.radius, shot.goal
    if search.origin == "source":
        radius += float(world.radius[shot.source]) if shot.source != NOBODY else 0.0
        origin = shot.start
    offset = world.pos[near] - origin
    edge = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) - world.radius[near]
    order = np.argsort(edge, kind="stable").tolist()
    found = [
        int(near[i])
        for i in order
        if edge[i] <= radius
        and near[i] != shot.prior
        and in_arc(offset[i, 0], offset[i, 1], float(world.radius[near[i]]), *forward, search.arc_deg)
    ]
    return found[: search.max_count] if search.max_count else found


def affected(world: World, affects: Affects, shot: Shot) -> Ints:
    """Return the living units that a splash, a search or a sweep may touch."""
    slots = world.live
    chosen = world.targetable[slots] & (world.life[slots] > 0.0)
    if not affects.allies:
        chosen &= world.owner[slots] != shot.owner
    if not affects.neutral:
        chosen &= world.owner[slots] != 0
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
