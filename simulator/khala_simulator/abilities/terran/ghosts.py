"""Ghosts: Steady Targeting (snipe), the EMP round and holding fire; ``cloaks`` and ``nukes`` have the rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import projectiles
from khala_simulator.abilities.shared.cancel import cancelling
from khala_simulator.abilities.skill import Skill, around, distance, number
from khala_simulator.combat import buffs
from khala_simulator.combat.damage import apply_damage
from khala_simulator.combat.targets import disengage
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    import numpy as np

    from khala_simulator.abilities.skill import BuffRule
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

# snipe ----------------------------------------------------------------------------------------------------------------

AIMING: Final = "ChannelSnipeCombat"
REFUNDABLE: Final = "ChannelSnipeRefund"
ATTACKING: Final = frozenset({OrderKind.ATTACK_UNIT, OrderKind.ATTACK_MOVE})


def _take_aim(world: World, cast: Cast) -> None:
    """Aim until the shot; damage or a target that gets away ends it and returns the energy."""
    buffs.apply(world, cast.slot, AIMING, source=cast.slot)
    buffs.apply(world, cast.slot, REFUNDABLE, source=cast.slot)


def _hold_aim(world: World, cast: Cast) -> bool:
    """Keep aiming until the shot, unless the Ghost is hurt or stunned or the target gets away."""
    slot, target = cast.slot, cast.target
    if target == NOBODY or world.damaged_loop[slot] >= cast.begun or not world.can_cast[slot]:
        return False
    if not (world.targetable[target] and world.visible[world.owner[slot], target]):
        return False
    limit = number(cast, "leash_range", 0.0)
    x, y = world.pos[target].tolist()
    if limit and distance(world, slot, (x, y)) > limit:
        return False
    if world.loop < cast.begun + number(cast, "channel_loops"):
        return True
    psionic = "psionic" in world.unit_type(target).attributes
    amount = number(cast, "damage") + (number(cast, "bonus_psionic", 0.0) if psionic else 0.0)
    buffs.remove(world, slot, REFUNDABLE)
    apply_damage(world, slot, int(world.owner[slot]), target, amount)
    return False


def _lower_aim(world: World, cast: Cast) -> None:
    """Give the energy back for a shot that was not fired."""
    buffs.remove(world, cast.slot, AIMING)
    if buffs.remove(world, cast.slot, REFUNDABLE):
        most = float(world.energy_max[cast.slot])
        world.energy[cast.slot] = min(float(world.energy[cast.slot]) + cast.ability.energy, most)


# EMP ------------------------------------------------------------------------------------------------------------------


def _fire_emp(world: World, cast: Cast) -> None:
    """Send a round that takes shields and energy from all around its point, and uncovers cloaked units."""
    projectiles.launch(world, cast, MECHANICS.emp_speed_n)


def _burst(world: World, missile: AreaEffect, _: int) -> None:
    """Take shields and energy from every unit around, friends as well, and uncover cloaked ones."""
    ability = world.catalog.ability(missile.ability)
    source = world.slot_of(missile.source)
    for slot in around(world, missile.at, number(ability, "radius")):
        apply_damage(world, source, missile.owner, slot, 0.0, shield_bonus=number(ability, "shields_removed"))
        world.energy[slot] = max(float(world.energy[slot]) - number(ability, "energy_removed"), 0.0)
        if not world.burrowed[slot]:
            loops = number(ability, "decloak_loops")
            buffs.apply(world, slot, "EMPDecloak", source=source, owner=missile.owner, loops=loops)


# holding fire ---------------------------------------------------------------------------------------------------------


def _hold_fire(world: World, cast: Cast) -> None:
    """Hold fire until ordered to attack."""
    buffs.apply(world, cast.slot, "GhostHoldFireB", source=cast.slot)
    if OrderKind(int(world.order_kind[cast.slot])) not in ATTACKING:
        disengage(world, cast.slot)


def _free_weapons(world: World, cast: Cast) -> None:
    """Fire again at any enemy that comes into range."""
    buffs.remove(world, cast.slot, "GhostHoldFireB")


def _fire_on_order(world: World, slot: int, _: np.void) -> None:
    """End holding fire for a Ghost with an attack order."""
    if OrderKind(int(world.order_kind[slot])) in ATTACKING:
        buffs.remove(world, slot, "GhostHoldFireB")


SKILLS: Final = {
    "channel_snipe": Skill(
        _take_aim,
        hold=_hold_aim,
        end=_lower_aim,
        estimates=("The distance at which a snipe's target has got away is measured from centre to centre.",),
    ),
    "cancel_channel_snipe": cancelling("channel_snipe"),
    "emp": Skill(_fire_emp, estimates=("The EMP round's speed.",)),
    "ghost_hold_fire": Skill(_hold_fire),
    "ghost_weapons_free": Skill(_free_weapons),
}
TICKS: Final[dict[str, BuffRule]] = {"GhostHoldFireB": _fire_on_order}

projectiles.ARRIVALS["emp"] = _burst
