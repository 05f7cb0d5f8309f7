"""Weapons: attacks start when the target is in reach and the weapon is ready, and take effect at the damage point.

The time from one start to the next is the period with a random delay; fractions of a loop carry over while the fight
goes on, so that the mean is exact. A beam ticks once per period without any delay, for as long as its target stays
within its slop. The hits of the attack, at once, later or by missile, are put into ``pending`` for ``hits``; weapons
that send out units instead are in ``LAUNCHERS``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat.launchers import LAUNCHERS
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import some, which
from khala_simulator.tables.stats import GROUND_PLANE
from khala_simulator.world.census import census
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.tables.records import Hit, Weapon
    from khala_simulator.world.columns import Bools, Floats, Ints
    from khala_simulator.world.world import World

NOT_STARTED = -1.0
LARGE_RADIUS = 1.25  # the catalog's validators TargetRadiusSmall and TargetRadiusLarge


def fire(world: World) -> None:
    """Start attacks, carry out those whose damage point has come, and count down."""
    n = world.top
    cooldown, windup, backswing = world.cooldown[:n], world.windup[:n], world.backswing[:n]
    cooldown -= cooldown > 0.0
    backswing -= backswing > 0.0
    started = windup >= 0.0
    if some(started):
        windup -= started
        _drop_lost(world, which(started & ~world.in_reach[:n]))
    fighters = world.fighters
    if fighters.size:
        if census(world).turrets:
            _turn_turrets(world, fighters[world.turreted.take(fighters)])
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
    """Drop attacks whose target got away before the damage point; they leave no cooldown."""
    if lost.size:
        world.windup[lost] = NOT_STARTED
        world.cooldown[lost] = 0.0
        world.scan_now = True


def _turn_turrets(world: World, slots: Ints) -> None:
    """Turn the turrets of units that fight towards their targets."""
    if not slots.size:
        return
    world.turret[slots] = geometry.turn_towards(
        world.turret.take(slots, 0),
        world.toward.take(slots, 0),
        world.turret_cos.take(slots),
        world.turret_sin.take(slots),
    )


def _aimed(world: World, slots: Ints) -> Bools:
    """Return whether each unit's body, or its turret, faces its target within the weapon's arc."""
    least = world.aim_cos.take(slots)
    any_way = least <= -1.0
    if np.count_nonzero(any_way) == len(any_way):
        return any_way
    facing = world.heading.take(slots, 0)
    turreted = world.turreted.take(slots)
    if some(turreted):
        facing = np.where(turreted[:, None], world.turret.take(slots, 0), facing)
    along = world.toward.take(slots, 0) * facing
    aimed: Bools = any_way | (along[:, 0] + along[:, 1] >= least)
    return aimed


def _start(world: World, slots: Ints) -> None:
    """Begin attacks: the cooldown of the next one runs from here."""
    for slot in slots.tolist():
        row = _weapon_at_hand(world, slot)
        weapon = world.catalog.weapons[row]
        rate = float(world.attack_rate[slot])
        delay = 0.0
        if not weapon.is_beam:
            low, high = weapon.jitter_loops
            delay = low + (high - low) * world.rng.random()
        world.cooldown[slot] += world.stats.period[world.owner[slot], row] / rate + delay
        world.windup[slot] = weapon.damage_point_loops / rate


def _weapon_at_hand(world: World, slot: int) -> int:
    """Return the row of the weapon for this attack: the one for close targets when the target stands that close."""
    close = int(world.close_weapon[slot])
    if close >= 0 and world.weapon[slot] in (close, world.ground_weapon[slot]):
        near = world.gap[slot] <= world.close_range[slot]
        world.weapon[slot] = close if near else world.ground_weapon[slot]
    return int(world.weapon[slot])


def _take_effect(world: World, slots: Ints) -> None:
    """Put the hits of finished attacks into ``pending``, weapon by weapon in the order of their first user."""
    rows = world.weapon[slots]
    moment = world.loop + world.windup[slots]
    for row in dict.fromkeys(rows.tolist()):
        weapon = world.catalog.weapons[row]
        mine = rows == row
        for index in range(len(weapon.hits)):
            _lay(world, weapon, index, slots[mine], moment[mine])
        world.backswing[slots[mine]] = weapon.backswing_loops
        world.beaming[slots[mine]] = weapon.is_beam
        launcher = LAUNCHERS.get(weapon.id)
        if launcher is not None:
            for slot in slots[mine].tolist():
                launcher(world, slot, int(world.target[slot]))
    world.windup[slots] = NOT_STARTED


def _lay(world: World, weapon: Weapon, index: int, slots: Ints, moment: Floats) -> None:
    """Put one hit of the attacks whose damage point was at ``moment`` (k,); bounces follow from the hit before."""
    hit = weapon.hits[index]
    if hit.bounce:
        return
    target = world.target[slots]
    if hit.when:
        chosen = branch(world, hit, weapon, slots, target)
        slots, target, moment = slots[chosen], target[chosen], moment[chosen]
    if slots.size:
        at = slots if weapon.is_kamikaze else target  # a suicide attacker is the middle of it
        world.pending.append(
            len(slots),
            source=slots,
            owner=world.owner[slots],
            target=target,
            prior=NOBODY,
            weapon=weapon.row,
            hit=index,
            due=moment + (0.0 if hit.sweep is not None else hit.delay_loops),
            single=False,
            goal=world.pos[at],
            start=world.pos[slots],
        )


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
