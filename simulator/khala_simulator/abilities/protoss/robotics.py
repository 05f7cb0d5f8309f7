"""Skills of what the robotics facility makes: Purification Nova and the Immortal's barrier.

Observers and Warp Prisms change mode by the common morph. The nova is a unit that its player may steer; an area effect
ties it to its Disruptor and makes it burst when its time is over.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.skill import Skill, around, number, place_of
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.damage import apply_damage
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    import numpy as np

    from khala_simulator.abilities.skill import BuffRule, UnitRule
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

NOVA_CASTER = "PurificationNovaTargettedCaster"
NOVA = "PurificationNovaTargettedTarget"
QUELLS_NOVA: Final = (
    "OracleStasisTrapTarget", "Yoink", "GravitonBeam", "MothershipRecalling", "NexusMassRecallWarpOut",
    "MothershipStrategicWarpOut", "RavenScramblerMissile",
)  # fmt: skip
BARRIER = "ImmortalOverload"
BARRIER_SPENT = "ImmortalBarrierSupressed"
BARRIER_ACTIVE = "TakenDamage"
BARRIER_ABILITY = 2328


# Purification Nova ----------------------------------------------------------------------------------------------------


def _nova(world: World, cast: Cast) -> None:
    """Send out a ball that can be steered and bursts when its time is over."""
    slot = cast.slot
    lasts = number(cast, "duration_loops")
    x, y = world.pos[slot].tolist()
    nova = lifecycle.spawn(world, world.catalog.unit(str(cast.ability.numbers["unit"])), int(world.owner[slot]), (x, y))
    world.heading[nova] = world.heading[slot]
    buffs.apply(world, slot, NOVA_CASTER, source=slot)
    buffs.apply(world, nova, NOVA, source=slot)
    commands.move(world, [nova], place_of(world, cast))
    world.area_effects.append(
        AreaEffect(
            "purification_nova",
            int(world.owner[slot]),
            [(x, y)],
            number(cast, "radius"),
            world.loop,
            world.loop + lasts,
            due=world.loop + 1,
            ability=cast.ability.id,
            source=world.tag_of(slot),
            target=world.tag_of(nova),
        )
    )


def _burn(world: World, area: AreaEffect) -> None:
    """Burst at the end; go out without harm when the Disruptor dies, is carried, or is out of its owner's hands."""
    disruptor, nova = world.slot_of(area.source), world.slot_of(area.target)
    held = (
        NOBODY not in (nova, disruptor)
        and world.carrier[disruptor] == NOBODY
        and not any(buffs.has(world, disruptor, name) for name in QUELLS_NOVA)
    )
    if not held:
        area.end = world.loop
    elif world.loop >= area.end:
        _burst(world, area, disruptor, nova)
    if area.end <= world.loop and nova != NOBODY:
        lifecycle.remove(world, nova)


def _burst(world: World, area: AreaEffect, disruptor: int, nova: int) -> None:
    """Hurt every ground unit around the nova, friends too; only the owner's own Disruptors are spared."""
    ability = world.catalog.ability(area.ability)
    x, y = world.pos[nova].tolist()
    amount, bonus = number(ability, "damage"), number(ability, "bonus_vs_shields")
    for slot in around(world, (x, y), area.radius, plane="ground"):
        own = int(world.owner[slot]) == area.owner
        if not (own and world.unit_type(slot).name == "Disruptor"):
            apply_damage(world, disruptor, area.owner, slot, amount, shield_bonus=bonus)


# the barrier ----------------------------------------------------------------------------------------------------------


def _guard(world: World, slots: list[int]) -> None:
    """Raise and lower the barriers of Immortals.

    Where the barrier is always up (5.0.13), it lasts for a while after the first damage to it; before (4.10), the first
    damage raises it. Then a cooldown runs until the next one.
    """
    stands = BARRIER_SPENT in world.catalog.buff_of_name
    for slot in slots:
        if stands:
            _guard_standing(world, slot)
        elif world.damaged_loop[slot] >= world.loop - 1:
            _guard_raised(world, slot)


def _guard_raised(world: World, slot: int) -> None:
    ability = world.catalog.ability(BARRIER_ABILITY)
    if buffs.has(world, slot, BARRIER):
        if world.barrier[slot] <= 0.0:
            buffs.remove(world, slot, BARRIER)
    elif world.timers.get(slot, {}).get(ability.timer, 0.0) <= world.loop and not buffs.has(
        world, slot, "GravitonBeam"
    ):
        world.timers.setdefault(slot, {})[ability.timer] = world.loop + ability.cooldown_loops
        _raise(world, slot)


def _guard_standing(world: World, slot: int) -> None:
    if world.barrier[slot] > 0.0:
        if world.damaged_loop[slot] >= world.loop - 1 and not buffs.has(world, slot, BARRIER_SPENT):
            buffs.apply(world, slot, BARRIER_SPENT, source=slot)
            buffs.apply(world, slot, BARRIER_ACTIVE, source=slot)
    elif buffs.has(world, slot, BARRIER):
        _lower(world, slot)
    elif not buffs.has(world, slot, BARRIER_SPENT):
        _raise(world, slot)


def _raise(world: World, slot: int) -> None:
    response = world.catalog.buff(BARRIER).response
    assert response is not None, "the barrier's buff says how much it takes"
    buffs.apply(world, slot, BARRIER, source=slot)
    world.barrier[slot] = response.limit


def _raise_by_order(world: World, cast: Cast) -> None:
    """Raise a barrier that absorbs damage; Immortals do it by themselves."""
    _raise(world, cast.slot)


def _lower(world: World, slot: int) -> None:
    buffs.remove(world, slot, BARRIER)
    world.barrier[slot] = 0.0


def _barrier_over(world: World, slot: int, _: np.void) -> None:
    world.barrier[slot] = 0.0


def _active_over(world: World, slot: int, _: np.void) -> None:
    _lower(world, slot)


SKILLS: Final = {
    "purification_nova_targeted": Skill(_nova, estimates=("The nova touches a unit whose edge is within its radius.",)),
    "immortal_overload": Skill(
        _raise_by_order,
        estimates=("Hits in the same loop as the first one get past a barrier that they raise.",),
    ),
}
AREA_EFFECTS: Final = {"purification_nova": _burn}
PASSIVES: Final[dict[str, UnitRule]] = {"Immortal": _guard}
ENDS: Final[dict[str, BuffRule]] = {BARRIER: _barrier_over, BARRIER_ACTIVE: _active_over}
