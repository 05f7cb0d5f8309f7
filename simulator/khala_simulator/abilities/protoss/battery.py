"""The Shield Battery: it fills the shields of what is near it with its energy; a Nexus can overcharge one (5.0.13)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities import commands
from khala_simulator.abilities.skill import Skill, gap, number
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import SmartRule
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

OVERCHARGE = "BatteryOvercharge"
OVERCHARGE_ABILITY = 4107


def _recharge(world: World, cast: Cast) -> bool:
    """Give one loop's shields; end when they are full, the energy is used up, or the unit has gone too far away."""
    slot = cast.slot
    target = int(world.order_target[slot])
    if target == NOBODY or not (world.can_cast[slot] and world.targetable[target]):
        return False
    if gap(world, slot, target) > cast.ability.range + cast.ability.slop + 1e-6:
        return False
    boost = _boost(world, slot)
    missing = float(world.shields_max[target] - world.shields[target])
    given = min(number(cast, "shields_per_n") / LOOPS_PER_NORMAL_SECOND * boost, missing)
    price = 0.0 if boost > 1.0 else number(cast, "energy_per_shield")
    if price:
        given = min(given, float(world.energy[slot]) / price)
    world.shields[target] += given
    world.energy[slot] -= given * price
    world.players[int(world.owner[target])].score.healed.shields += given
    return given > 0.0 and world.shields[target] < world.shields_max[target]


def _begin(world: World, cast: Cast) -> None:
    """Fill a unit's shields, loop by loop, with the battery's energy."""
    _recharge(world, cast)


def _boost(world: World, slot: int) -> float:
    """Return how many times faster than usual a battery works; an overcharged one spends no energy."""
    if OVERCHARGE not in world.catalog.buff_of_name or not buffs.has(world, slot, OVERCHARGE):
        return 1.0
    return number(world.catalog.ability(OVERCHARGE_ABILITY), "rate")


def _cant_recharge(world: World, cast: Cast) -> ActionResult:
    target = cast.target
    if target == NOBODY or world.shields[target] >= world.shields_max[target]:
        return ActionResult.CANT_TARGET_THAT_UNIT
    if world.unit_type(target).name == "Interceptor":
        return ActionResult.CANT_TARGET_THAT_UNIT
    if world.channels[cast.slot] or _boost(world, cast.slot) > 1.0:
        return ActionResult.SUCCESS
    energy = float(world.energy[cast.slot])
    enough = energy > 0.0 and energy >= number(cast, "least_energy")
    return ActionResult.SUCCESS if enough else ActionResult.NOT_ENOUGH_ENERGY


def _stop(world: World, cast: Cast) -> None:
    """End the recharging."""
    commands.begin_next(world, cast.slot)


def _cant_stop(world: World, cast: Cast) -> ActionResult:
    return ActionResult.SUCCESS if cast.slot in world.channelling else ActionResult.CANT_FIND_CANCEL_ORDER


def _overcharge(world: World, cast: Cast) -> None:
    """Make a battery work faster and without energy for a while."""
    buffs.apply(world, cast.target, OVERCHARGE, source=cast.slot, loops=number(cast, "duration_loops"))


def _cant_overcharge(world: World, cast: Cast) -> ActionResult:
    target = cast.target
    if target == NOBODY or world.unit_type(target).name != "ShieldBattery" or buffs.has(world, target, OVERCHARGE):
        return ActionResult.CANT_TARGET_THAT_UNIT
    if world.build_progress[target] < 1.0:
        return ActionResult.CANT_TARGET_UNDER_CONSTRUCTION_UNITS
    mine = world.units_of(int(world.owner[cast.slot]))
    nexus = mine[(world.type[mine] == world.catalog.unit("Nexus").row) & (world.build_progress[mine] >= 1.0)]
    offset = world.pos[nexus] - world.pos[target]
    away = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) - world.radius[nexus]
    near = bool((away <= number(cast, "nexus_range")).any())
    return ActionResult.SUCCESS if near else ActionResult.TARGET_IS_OUT_OF_RANGE


def recharge_by_click(
    world: World, slots: list[int], target: int, _: Point | None, queue: bool
) -> list[int]:  # fmt: skip
    """Right-click a unit with a battery: recharge it, if that is possible now."""
    taken: list[int] = []
    for slot in slots if target != NOBODY else ():
        card = world.catalog.abilities_of(int(world.type[slot]))
        ability = next((a for a in card if a.effect == "recharge_shields"), None)
        if ability is None or world.owner[target] != world.owner[slot] or gap(world, slot, target) > ability.range:
            continue
        if _cant_recharge(world, Cast(slot, ability, target)) is ActionResult.SUCCESS:
            order = Order(OrderKind.CAST, ability.id, target=world.tag_of(target))
            taken += commands.give(world, [slot], order, queue=queue)
    return taken


SKILLS: Final = {
    "recharge_shields": Skill(_begin, refuse=_cant_recharge, hold=_recharge),
    "stop_recharging": Skill(_stop, refuse=_cant_stop),
    "battery_overcharge": Skill(
        _overcharge, refuse=_cant_overcharge, estimates=("An overcharged battery spends no energy.",)
    ),
}
SMARTS: Final[tuple[SmartRule, ...]] = (recharge_by_click,)
