"""Weapons: attacks start when the target is in reach and the weapon is ready, and take effect at the damage point.

The time from one start to the next is the period with a random delay; fractions of a loop carry over while the fight
goes on, so that the mean is exact. A beam ticks once per period without any delay, for as long as its target stays
within its slop. The hits of the attack, at once, later or by missile, are put into ``pending`` for ``hits``; weapons
that send out units instead are in ``LAUNCHERS``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import census
from khala_simulator.combat.launchers import LAUNCHERS
from khala_simulator.movement import turning
from khala_simulator.native import chance, columns, memory
from khala_simulator.tables.stats import GROUND_PLANE
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import PendingHit, Shot

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.native.columns import Columns
    from khala_simulator.tables.records import Hit, Weapon
    from khala_simulator.world.columns import Bools, Ints
    from khala_simulator.world.world import World

NOT_STARTED: Final = -1.0
LARGE_RADIUS = 1.25  # the catalog's validators TargetRadiusSmall and TargetRadiusLarge


def fire(world: World) -> None:
    """Start attacks, carry out those whose damage point has come, and count down."""
    c = columns.columns_of(world)
    n = world.top
    lost = False
    for slot in range(n):
        _count_down(c, slot)
        if _is_under_way(c, slot) and not c.in_reach[slot]:  # the target got away before the damage point
            c.windup[slot] = NOT_STARTED
            c.cooldown[slot] = 0.0
            lost = True
    if lost:
        world.scan_now = True
    if len(world.fighters):
        _start_attacks(world, c)
        attackers = []
        for slot in range(n):
            if _takes_effect(c, slot):
                attackers.append(slot)  # noqa: PERF401  # a comprehension would not know the types of C
        if attackers:
            _take_effect(world, attackers)
            c = columns.columns_of(world)
    for slot in range(n):
        c.cooldown[slot] = max(c.cooldown[slot], 0.0)  # a fraction is carried over only into the very next attack


def _count_down(c: Columns, slot: int) -> None:
    """Count what a unit's attacks take by one loop."""
    if c.cooldown[slot] > 0.0:
        c.cooldown[slot] -= 1.0
    if c.backswing[slot] > 0.0:
        c.backswing[slot] -= 1.0
    if c.windup[slot] >= 0.0:
        c.windup[slot] -= 1.0


def _is_under_way(c: Columns, slot: int) -> bool:
    """Return whether an attack has started whose damage point has not been carried out."""
    return c.windup[slot] > NOT_STARTED


def _takes_effect(c: Columns, slot: int) -> bool:
    """Return whether the damage point of an attack has come."""
    return _is_under_way(c, slot) and c.windup[slot] <= 0.0


def _start_attacks(world: World, c: Columns) -> None:
    """Turn turrets, and begin the attacks of units that are ready and aim at what they reach."""
    fighters = world.fighters
    slots = memory.ints(fighters)
    turrets = census.census(world).turrets
    for i in range(len(fighters)):
        slot = slots[i]
        if turrets and c.turreted[slot]:
            c.turret[slot] = turning.turn(c.turret[slot], c.toward[slot], c.turret_cos[slot], c.turret_sin[slot])
        if not c.in_reach[slot] or c.cooldown[slot] > 0.0 or _is_under_way(c, slot) or not _is_aimed(c, slot):
            continue
        _start(world, c, slot)


def _start(world: World, c: Columns, slot: int) -> None:
    """Begin an attack."""
    stats = world.stats
    weapons = stats.weapons
    row = _choose_weapon(c, slot)
    if row < 0:  # no weapon: the last of the catalog stands for it, as it always has
        row += weapons
    delay = 0.0
    if not memory.bools(stats.beam)[row]:
        delay = draw_delay(world, memory.points(stats.jitter)[row])
    c.cooldown[slot] += memory.floats(stats.period)[c.owner[slot] * weapons + row] / c.attack_rate[slot] + delay
    c.windup[slot] = memory.floats(stats.damage_point)[row] / c.attack_rate[slot]


def draw_delay(world: World, jitter: memory.Point) -> float:
    """Return a random delay of a weapon's period in loops, between the two of its ``jitter``."""
    return jitter.x + (jitter.y - jitter.x) * chance.draw(world.rng)


def _is_aimed(c: Columns, slot: int) -> bool:
    """Return whether a unit's body, or its turret, faces its target within the weapon's arc."""
    if c.aim_cos[slot] <= -1.0:
        return True
    facing = c.turret[slot] if c.turreted[slot] else c.heading[slot]
    return c.toward[slot].x * facing.x + c.toward[slot].y * facing.y >= c.aim_cos[slot]


def _choose_weapon(c: Columns, slot: int) -> int:
    """Return the row of the weapon for this attack: the one for close targets when the target stands that close."""
    near = c.close_weapon[slot]
    if near >= 0 and (c.weapon[slot] == near or c.weapon[slot] == c.ground_weapon[slot]):
        c.weapon[slot] = near if c.gap[slot] <= c.close_range[slot] else c.ground_weapon[slot]
    return c.weapon[slot]


def _take_effect(world: World, attackers: list[int]) -> None:
    """Put the hits of finished attacks into ``pending``, weapon by weapon in the order of their first user."""
    c = columns.columns_of(world)
    users: dict[int, list[int]] = {}
    for slot in attackers:
        users.setdefault(c.weapon[slot], []).append(slot)
    for row, slots in users.items():
        weapon = world.catalog.weapons[row]
        is_beam = memory.bools(world.stats.beam)[row]
        backswing = memory.floats(world.stats.backswing)[row]
        for index in range(len(world.stats.damage[0][row])):
            _lay(world, row, index, slots)
        for slot in slots:
            c.backswing[slot] = backswing
            c.beaming[slot] = is_beam
            c.bursting[slot] = True
        launcher = LAUNCHERS.get(weapon.id)
        if launcher is not None:
            for slot in slots:
                launcher(world, slot, columns.columns_of(world).target[slot])
            c = columns.columns_of(world)
    for slot in attackers:
        c.windup[slot] = NOT_STARTED


def _lay(world: World, row: int, index: int, attackers: list[int]) -> None:
    """Put one hit of the attacks of some units with one weapon into ``pending``."""
    damage = world.stats.damage[0][row][index]  # when it comes is the same for every player
    if damage.follows:
        return
    if damage.conditional:
        sources = np.array(attackers)
        weapon = world.catalog.weapons[row]
        attackers = sources[branch(world, damage.hit, weapon, sources, world.target[sources])].tolist()
    c = columns.columns_of(world)
    is_kamikaze = memory.bools(world.stats.kamikaze)[row]
    pending = world.pending
    loop = world.loop
    for slot in attackers:
        target = c.target[slot]
        at = slot if is_kamikaze or target == NOBODY else target  # a suicide attacker is the middle of it
        shot = _shoot(c, slot, at, row, index)
        pending.append(PendingHit(shot, (loop + c.windup[slot]) + damage.delay))


def _shoot(c: Columns, slot: int, at: int, weapon: int, hit: int) -> Shot:
    """Return the shot of one hit of an attack from a unit's place to that of the unit ``at``."""
    shot = Shot.__new__(Shot)
    shot.source = slot
    shot.owner = c.owner[slot]
    shot.target = c.target[slot]
    shot.prior = NOBODY
    shot.weapon = weapon
    shot.hit = hit
    shot.start_x = c.pos[slot].x
    shot.start_y = c.pos[slot].y
    shot.goal_x = c.pos[at].x
    shot.goal_y = c.pos[at].y
    return shot


# branches of the game's own switches ----------------------------------------------------------------------------------


def branch(world: World, hit: Hit, weapon: Weapon, source: Ints, target: Ints) -> Bools:
    """Return (k,) whether the game's switch takes the branch of ``hit``; unknown conditions never hold."""
    if hit.when == "else":
        others = [h.when for h in weapon.hits if h.when not in ("", "else")]
        taken = np.zeros(len(target), dtype=np.bool_)
        for name in others:
            taken |= _condition(world, name, source, target)
        return ~taken
    return _condition(world, hit.when, source, target)


def _condition(world: World, name: str, source: Ints, target: Ints) -> Bools:
    condition = CONDITIONS.get(name)
    if condition is None:
        return np.zeros(len(target), dtype=np.bool_)
    holds: Bools = condition(world, source, target)
    return holds


def _on_ground(world: World, source: Ints, target: Ints) -> Bools:
    del source
    on_ground: Bools = (world.plane_bits[target] & GROUND_PLANE) != 0
    return on_ground


def _large(world: World, source: Ints, target: Ints) -> Bools:
    del source
    large: Bools = world.radius[target] >= LARGE_RADIUS
    return large


def _friendly(world: World, source: Ints, target: Ints) -> Bools:
    friendly: Bools = world.owner[source] == world.owner[target]
    return friendly


def _structure(world: World, source: Ints, target: Ints) -> Bools:
    del source
    walled: Bools = world.walled[target]
    return walled


CONDITIONS: Final[dict[str, Callable[[World, Ints, Ints], Bools]]] = {
    "GroundUnitFilter": _on_ground,
    "TargetRadiusLarge": _large,
    "TargetRadiusSmall": lambda world, source, target: ~_large(world, source, target),
    "IsStructure": _structure,
    "FriendlyTarget": _friendly,
    "FriendlyStructure": lambda world, source, target: (
        _friendly(world, source, target) & _structure(world, source, target)
    ),
    "FriendlyUnit": lambda world, source, target: _friendly(world, source, target) & ~_structure(world, source, target),
}
"""The game's validators, each a function of the world, the attackers (k,) and the targets (k,)."""
