"""Cyclone: Lock On, which fires missiles at its target while the Cyclone goes where it wants.

The lock is an area effect that moves with the target: its owner sees there, it fires at its periods, and it ends when
the target is dead, hidden or too far away, or the Cyclone is dead, helpless or calls it off. The cooldown runs from
then on. In 4.10 each period is one missile of the ability's own; in 5.0.13 the lock fires the ordinary weapon's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import projectiles
from khala_simulator.abilities.skill import Skill, distance, number
from khala_simulator.combat import buffs
from khala_simulator.combat.damage import apply_damage
from khala_simulator.tables.stats import ATTRIBUTES
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import PendingHit, Shot

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import AreaEffectRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

LOCKED: Final = "LockOn"
LOCKING: Final = "LockOnDisableAttack"
TICK: Final = "CycloneWeaponDamage"
UPGRADE_FIELD: Final = "AttributeBonus[Armored]"


def _lock(world: World, cast: Cast) -> None:
    """Fire missiles at one target for as long as it is seen and near, and walk freely meanwhile."""
    slot, ability = cast.slot, cast.ability
    buffs.apply(world, cast.target, LOCKED, source=slot)
    buffs.apply(world, slot, LOCKING, source=slot)
    world.timers.get(slot, {}).pop(ability.timer, None)
    x, y = world.pos[cast.target].tolist()
    lasts = number(cast, "ticks") * number(cast, "tick_period_loops")
    world.area_effects.append(
        AreaEffect(
            "lock_on",
            owner=int(world.owner[slot]),
            points=[(x, y)],
            radius=0.0,
            begun=world.loop,
            end=world.loop + lasts + 1,
            due=world.loop + 1,
            ability=ability.id,
            source=world.tag_of(slot),
            target=world.tag_of(cast.target),
            sights=number(cast, "reveal_radius"),
            memory={"next": world.loop + number(cast, "first_shot_loops"), "last": world.loop + lasts},
        )
    )


def _track(world: World, lock: AreaEffect) -> None:
    """Follow the target and fire when it is time, or end the lock."""
    ability = world.catalog.ability(lock.ability)
    slot, target = world.slot_of(lock.source), world.slot_of(lock.target)
    if NOBODY in (slot, target) or not _holds(world, ability, slot, target):
        _release(world, lock, ability)
        return
    x, y = world.pos[target].tolist()
    lock.points = [(x, y)]
    if world.loop >= lock.memory["next"]:
        lock.memory["next"] += number(ability, "shot_loops") / float(world.attack_rate[slot])
        _shoot(world, ability, slot, target)
    if world.loop >= lock.memory["last"]:
        _release(world, lock, ability)


def _holds(world: World, ability: Ability, slot: int, target: int) -> bool:
    x, y = world.pos[target].tolist()
    seen = bool(world.visible[world.owner[slot], target]) and world.carrier[target] == NOBODY
    free = bool(world.can_cast[slot]) and world.carrier[slot] == NOBODY and buffs.has(world, slot, LOCKING)
    near = distance(world, slot, (x, y)) < number(ability, "leash_range")
    return seen and free and near and bool(world.targetable[target])


def _shoot(world: World, ability: Ability, slot: int, target: int) -> None:
    """Send one missile: the ordinary weapon's where the ability names it, else one with the ability's own damage."""
    owner = int(world.owner[slot])
    weapon = next(w for w in world.unit_type(slot).weapons if w.id == ability.numbers["weapon"])
    if number(ability, "damage_per_tick", 0.0):
        projectiles.launch_at(world, ability, slot, target, weapon.hits[0].missile_speed_n or 0.0)
    else:
        shot = Shot(slot, owner, target, NOBODY, weapon.row, 0, world.pos[slot], world.pos[target])
        world.pending.append(PendingHit(shot, world.loop))
        world.cooldown[slot] = max(float(world.cooldown[slot]), number(ability, "shot_loops"))


def _hit(world: World, missile: AreaEffect, target: int) -> None:
    ability = world.catalog.ability(missile.ability)
    owner = missile.owner
    armored = world.stats.attribute_bits[world.type[target]] & 1 << ATTRIBUTES.index("armored")
    more = world.stats.with_upgrades(owner, "effect", TICK, UPGRADE_FIELD, 0.0) if armored else 0.0
    source = world.slot_of(missile.source)
    apply_damage(world, source, owner, target, number(ability, "damage_per_tick") + more)


def _release(world: World, lock: AreaEffect, ability: Ability) -> None:
    """End a lock; the Cyclone fights as usual again, and the next lock has to wait."""
    projectiles.end(world, lock)
    slot, target = world.slot_of(lock.source), world.slot_of(lock.target)
    if slot != NOBODY:
        buffs.remove(world, slot, LOCKING)
        loops = number(ability, "cooldown_after_lock_ends_loops")
        world.timers.setdefault(slot, {})[ability.timer] = world.loop + loops
    others = any(f.rule == "lock_on" and f.target == lock.target and f is not lock for f in world.area_effects)
    if target != NOBODY and not others:
        buffs.remove(world, target, LOCKED)


def _call_off(world: World, cast: Cast) -> None:
    """Drop the target; the next lock has to wait."""
    for lock in world.area_effects:
        if lock.rule == "lock_on" and lock.source == world.tag_of(cast.slot):
            _release(world, lock, world.catalog.ability(lock.ability))


SKILLS: Final = {
    "lock_on": Skill(
        _lock,
        estimates=(
            "The first of Lock On's missiles leaves after one period in 4.10, at once in 5.0.13.",
            "The leash is measured from centre to centre, in every loop.",
        ),
    ),
    "cancel_lock_on_cancel": Skill(_call_off),
}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {"lock_on": _track}

projectiles.ARRIVALS["lock_on"] = _hit
