"""Medivacs: healing, and the afterburners. Carrying is in ``transports``.

A Medivac heals one unit at a time for energy, follows it while it walks, and does so by itself unless autocast is off.
Two Medivacs never heal the same unit at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared.basics import on_self
from khala_simulator.abilities.skill import Skill, gap, nearest_hurt, number
from khala_simulator.combat.healing import heal, is_hurt
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.stats import ATTRIBUTES
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.world import World

DONE: Final = 1e-9
BIOLOGICAL: Final = 1 << ATTRIBUTES.index("biological")


def _can_heal(world: World, cast: Cast) -> ActionResult:
    """Refuse units that need no healing or already have a healer, and Medivacs without energy."""
    slot, target = cast.slot, cast.target
    if target == NOBODY:
        return ActionResult.MUST_TARGET_UNIT
    if not is_hurt(world, target) or _is_healed(world, cast):
        return ActionResult.REQUIRES_HEAL_TARGET
    return ActionResult.SUCCESS if world.energy[slot] > 0.0 else ActionResult.NOT_ENOUGH_ENERGY


def _is_healed(world: World, cast: Cast) -> bool:
    """Return whether another Medivac heals the target now."""
    return any(
        other.target == cast.target and other.ability.effect == cast.ability.effect and slot != cast.slot
        for slot, other in world.channelling.items()
    )


def _heal(world: World, cast: Cast) -> bool:
    """Heal for one loop while the target is near (a Medivac follows), until its life is full or the energy is gone."""
    slot, target = cast.slot, cast.target
    if target == NOBODY or not world.can_cast[slot] or not world.targetable[target]:
        return False
    if gap(world, slot, target) > cast.ability.range:
        resume(world, slot)
        return True
    price = number(cast, "energy_per_life")
    rate = number(cast, "life_per_s_normal") / LOOPS_PER_NORMAL_SECOND
    healed = heal(world, target, min(rate, float(world.energy[slot]) / price))
    world.energy[slot] -= healed * price
    return is_hurt(world, target) and bool(world.energy[slot] > DONE)


def resume(world: World, slot: int) -> None:
    """Make a caster walk into range again and go on from there."""
    world.channels[slot] = False
    world.cast_at[slot] = -1.0


def _pick(world: World, slot: int, ability: Ability) -> int:
    """Return the nearest friend that needs healing and has no healer."""
    hurt = nearest_hurt(world, slot, ability.autocast_range, BIOLOGICAL)
    return next(
        (other for other in hurt if _can_heal(world, Cast(slot, ability, other)) is ActionResult.SUCCESS), NOBODY
    )


def _begin(world: World, cast: Cast) -> None:
    """Give a friend life for energy, loop by loop, as long as both last and the friend can be followed."""
    _heal(world, cast)


def _ignite(world: World, cast: Cast) -> None:
    """Fly faster for a time."""
    on_self("MedivacSpeedBoost")(world, cast)


SKILLS: Final = {
    "medivac_heal": Skill(
        _begin,
        refuse=_can_heal,
        hold=_heal,
        pick=_pick,
        estimates=(
            "Healing is given evenly in every loop.",
            "A Medivac follows the unit that it heals at half the range at which it begins.",
        ),
    ),
    "medivac_speed_boost": Skill(_ignite),
}
