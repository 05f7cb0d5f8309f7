"""Damage: what a hit takes from which unit.

A hit on a unit takes the damage, with its bonus against the unit's attributes, less armor, at least 0.5: from the
shields first, with the shields' armor, and the rest from life, with the body's. Splash takes its ring's fraction before
armor. The formula's source is in ``data/SOURCES.md``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.native import columns, memory
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import AIR_PLANE, GROUND_PLANE
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.native.columns import Columns
    from khala_simulator.tables.records import Affects, Search
    from khala_simulator.tables.stats import Damage
    from khala_simulator.world.shots import Shot
    from khala_simulator.world.world import World

BEHIND: Final = 1e-9
ALLIES: Final = 1
NEUTRAL: Final = 2
STRUCTURES: Final = 4
OTHERS: Final = 8
SOURCE: Final = 16
TARGET: Final = 32
ON_GROUND: Final = 64
IN_AIR: Final = 128
ANYWHERE: Final = ON_GROUND | IN_AIR
DAMAGE_MIN: Final = MECHANICS.damage_min
ALL_ROUND_DEG: Final = 360.0

IMPACTS: Final[dict[str, Callable[[World, int, int, int], None]]] = {}
"""What a hit does to its target in addition to its damage, by the hit's effect: a function of the world, the attacker
(a slot or NOBODY), its owner and the target."""


def hit_with(world: World, shot: Shot) -> None:
    """Carry out one hit: on its target, in the rings around it, or on the units that a second search finds."""
    damage = _damage_of(world, shot)
    hit = damage.hit
    if damage.plain:
        hit_target(world, shot)
    elif hit.kills_self:
        _give_life(world, shot.source)
    elif hit.search is not None and not hit.bounce:
        for slot in found_by(world, hit.search, shot):
            strike(world, shot.source, shot.owner, slot, damage)
    else:
        _splash(world, shot, damage)
        if hit.area_affects.not_target:
            hit_target(world, shot)


def _damage_of(world: World, shot: Shot) -> Damage:
    return world.stats.damage[shot.owner][shot.weapon][shot.hit]


def hit_target(world: World, shot: Shot) -> None:
    """Carry out a hit on its target alone, if that still lives."""
    if shot.target == NOBODY:
        return
    damage = _damage_of(world, shot)
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
    c = columns.columns_of(world)
    attributes = memory.ints(world.stats.attribute_bits)[c.type[victim]]
    amount = amount_against(damage, attributes) * fraction
    if source != NOBODY:
        if c.bonus_bits[source] & attributes:
            amount += c.bonus_add[source] * fraction
        amount *= c.dealt_factor[source]
    kind = "splash" if fraction < 1.0 else damage.kind
    apply_damage(world, source, owner, victim, amount, kind=kind, ignores_armor=damage.ignores_armor)


def amount_against(damage: Damage, attributes: int) -> float:
    """Return the damage before armor on a unit with these attribute bits; only the largest fitting bonus counts."""
    if not damage.bonus:
        return damage.amount
    most = 0.0
    for bit, value in damage.bonus:
        if attributes & bit:
            most = max(most, value)
    return damage.amount + most


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
    c = columns.columns_of(world)
    if not c.targetable[victim] or c.life[victim] <= 0.0 or amount <= 0.0 >= shield_bonus:
        return
    side = c.owner[victim]
    answer = c.ranged_add[victim] if kind == "ranged" else c.melee_add[victim] if kind == "melee" else 0.0
    if answer != 0.0:
        amount = max(amount + answer, DAMAGE_MIN)
    amount *= c.taken_factor[victim]
    if source != NOBODY and kind != "spell" and c.plane_bits[source] & AIR_PLANE:
        amount *= c.air_taken_factor[victim]
    if c.barrier[victim] > 0.0:
        held = min(c.barrier[victim], amount)
        c.barrier[victim] -= held
        amount -= held
    shield_armor = 0.0
    armor = 0.0
    if not ignores_armor:
        numbers = world.stats
        at = side * numbers.types + c.type[victim]
        shield_armor = memory.floats(numbers.shield_armor)[at] + c.shield_armor_add[victim]
        armor = memory.floats(numbers.armor)[at] + c.armor_add[victim]
    least = DAMAGE_MIN if amount > 0.0 else 0.0
    absorbed = 0.0
    rest = amount
    if c.shields[victim] > 0.0:
        reduced = max(amount + shield_bonus - shield_armor, least)
        absorbed = min(c.shields[victim], reduced)
        rest = max(min(reduced, amount) - absorbed, 0.0)
    wounded = min(c.life[victim], max(rest - armor, least)) if rest > 0.0 else 0.0
    c.shields[victim] -= absorbed
    c.life[victim] -= wounded
    c.damaged_loop[victim] = world.loop
    _count(world, owner, side, absorbed, wounded)
    if source != NOBODY:
        c.attacker[victim] = source
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
    c = columns.columns_of(world)
    live = world.live
    slots = memory.ints(live)
    affects = bits_of(damage.hit.area_affects)
    rings = [(ring.radius, ring.fraction, ring.arc_deg) for ring in damage.hit.area]
    widest = max([radius for radius, _, _ in rings])
    forward_x = shot.goal_x - shot.start_x
    forward_y = shot.goal_y - shot.start_y
    for i in range(len(live)):
        slot = slots[i]
        x = c.pos[slot].x - shot.goal_x
        y = c.pos[slot].y - shot.goal_y
        edge = memory.length(x, y) - c.radius[slot]
        if edge > widest or not touches(c, affects, shot, slot):
            continue
        for radius, fraction, arc_deg in rings:
            if edge <= radius and in_arc(x, y, c.radius[slot], forward_x, forward_y, arc_deg):
                strike(world, shot.source, shot.owner, slot, damage, fraction)
                break


def in_arc(x: float, y: float, radius: float, forward_x: float, forward_y: float, arc_deg: float) -> bool:
    """Return whether a body touches the sector of an arc, at most 180 degrees or all round, in the shot's direction."""
    if arc_deg >= ALL_ROUND_DEG:
        return True
    length = math.hypot(forward_x, forward_y)
    along = x * forward_x + y * forward_y
    across = abs(x * forward_y - y * forward_x)
    half = math.radians(arc_deg / 2.0)
    cosine = math.cos(half)
    sine = math.sin(half)
    beyond = across * cosine - along * sine <= (radius + BEHIND) * length  # from the edge of the sector
    return (beyond and along * cosine + across * sine >= 0.0) or math.hypot(x, y) <= radius


def found_by(world: World, search: Search, shot: Shot) -> list[int]:
    """Return the slots that a second search finds, nearest first; from the source the radius counts from the edge.

    The unit that the shot bounced from is not found again.
    """
    c = columns.columns_of(world)
    live = world.live
    slots = memory.ints(live)
    affects = bits_of(search.affects)
    from_source = search.origin == "source"
    origin_x = shot.start_x if from_source else shot.goal_x
    origin_y = shot.start_y if from_source else shot.goal_y
    reach = search.radius + (c.radius[shot.source] if from_source and shot.source != NOBODY else 0.0)
    forward_x = shot.goal_x - shot.start_x
    forward_y = shot.goal_y - shot.start_y
    found = []
    for i in range(len(live)):
        slot = slots[i]
        if slot == shot.prior or not touches(c, affects, shot, slot):
            continue
        x = c.pos[slot].x - origin_x
        y = c.pos[slot].y - origin_y
        edge = memory.length(x, y) - c.radius[slot]
        if edge <= reach and in_arc(x, y, c.radius[slot], forward_x, forward_y, search.arc_deg):
            found.append((edge, slot))
    nearest = [slot for _, slot in sorted(found)]
    return nearest[: search.max_count] if search.max_count else nearest


def bits_of(affects: Affects) -> int:
    """Return which units a splash, a search or a sweep may touch, as the bits that ``touches`` reads."""
    bits = (ALLIES if affects.allies else 0) | (NEUTRAL if affects.neutral else 0)
    bits |= 0 if affects.only == "structure" else OTHERS
    bits |= 0 if affects.excluding == "structure" else STRUCTURES
    bits |= (0 if affects.not_self else SOURCE) | (0 if affects.not_target else TARGET)
    bits |= 0 if affects.plane == "air" else ON_GROUND
    bits |= 0 if affects.plane == "ground" else IN_AIR
    return bits


def touches(c: Columns, affects: int, shot: Shot, slot: int) -> bool:
    """Return whether a splash, a search or a sweep may touch a living unit."""
    if not c.targetable[slot] or not c.life[slot] > 0.0:
        return False
    if (not affects & ALLIES and c.owner[slot] == shot.owner) or (not affects & NEUTRAL and c.owner[slot] == 0):
        return False
    if not affects & (STRUCTURES if c.walled[slot] else OTHERS):
        return False
    if (not affects & SOURCE and slot == shot.source) or (not affects & TARGET and slot == shot.target):
        return False
    if affects & ANYWHERE == ANYWHERE:
        return True
    return c.plane_bits[slot] & (GROUND_PLANE if affects & ON_GROUND else AIR_PLANE) != 0
