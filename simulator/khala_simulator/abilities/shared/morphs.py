"""Morphs that are paid for when they begin and take their time in a cocoon or in place, and calling morphs off.

A Zergling that becomes a Baneling, a Hatchery that becomes a Lair: the price is charged at the beginning, and the unit
is a cocoon (if there is one) until the time has passed or the morph is called off. Morphs that cost nothing, such as
burrowing, are in ``basics``; calling them off is here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import lifecycle
from khala_simulator.economy import payments
from khala_simulator.tables import prices
from khala_simulator.tables.action_result import ActionResult

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World


def _grow(world: World, cast: Cast) -> None:
    """Become a cocoon, if there is one, and at the end the new type."""
    world.cast_begun[cast.slot], world.cast_at[cast.slot] = world.loop, world.loop + cast.ability.loops
    cocoon = str(cast.ability.numbers.get("cocoon", ""))
    if cocoon:
        _renew(world, cast.slot, world.catalog.unit(cocoon))


def _grows(world: World, cast: Cast) -> bool:
    if world.loop < cast.begun + cast.ability.loops:
        return True
    unit = world.catalog.unit(cast.ability.unit)
    if cast.ability.numbers.get("cocoon"):
        _renew(world, cast.slot, unit)
    else:
        lifecycle.become(world, cast.slot, unit)
    world.alert(int(world.owner[cast.slot]), "MorphComplete")
    return False


def _renew(world: World, slot: int, unit: UnitType) -> None:
    """Become another type with full life, as when a unit enters or leaves a cocoon."""
    lifecycle.become(world, slot, unit)
    world.life[slot] = world.life_max[slot]
    world.energy[slot] = min(
        float(world.stats.energy_start[world.owner[slot], unit.row]), float(world.energy_max[slot])
    )


def _can_grow(world: World, slot: int, _: Ability) -> ActionResult:
    return ActionResult.CANT_QUEUE_THAT_ORDER if slot in world.jobs or grows(world, slot) else ActionResult.SUCCESS


def grows(world: World, slot: int) -> bool:
    """Return whether a unit is in the middle of such a morph."""
    growing = world.channelling.get(slot)
    return growing is not None and growing.ability.effect == "grow"


def call_off(world: World, slot: int) -> None:
    """Turn a growing unit back into its former type; refund three quarters of the price."""
    growing = world.channelling[slot]
    was = world.catalog.units[growing.was]
    if world.type[slot] != was.row:
        _renew(world, slot, was)
    payments.refund(world, int(world.owner[slot]), prices.cost_of(growing.ability), payments.CANCELLED)
    commands.begin_next(world, slot)


def _call_off_growth(world: World, cast: Cast) -> None:
    """Turn back into the former type; refund three quarters of the price."""
    if grows(world, cast.slot):
        call_off(world, cast.slot)


def _grows_now(world: World, slot: int, _: Ability) -> ActionResult:
    return ActionResult.SUCCESS if grows(world, slot) else ActionResult.CANT_FIND_CANCEL_ORDER


def _call_off_morph(world: World, cast: Cast) -> None:
    """Drop the morph under way and stay the same type."""
    commands.begin_next(world, cast.slot)


def _morphs_now(world: World, slot: int, _: Ability) -> ActionResult:
    under_way = world.casts[slot] and world.bound[slot] and not world.channels[slot]
    return ActionResult.SUCCESS if under_way else ActionResult.CANT_FIND_CANCEL_ORDER


SKILLS: Final = {
    "grow": Skill(
        _grow,
        ready=_can_grow,
        hold=_grows,
        binds=True,
        estimates=(
            "A cocoon, and what comes out of it, has all of its life, and the energy that its type starts with.",
        ),
    ),
    "cancel_growth": Skill(_call_off_growth, ready=_grows_now, estimates=("Three quarters of the price come back.",)),
    "cancel_morph": Skill(_call_off_morph, ready=_morphs_now),
}
