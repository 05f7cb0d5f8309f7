"""Autocast: units use abilities by themselves where their player allows it.

Checked every few loops. A unit that walks or fights on order interrupts only for abilities that leave its orders alone;
one that idles, patrols or attack-moves does it as an order of its own and goes on afterwards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities import casting, commands
from khala_simulator.economy.requirements import lacks_upgrade
from khala_simulator.native import columns
from khala_simulator.tables.abilities import AbilityAim
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.world import World

SCAN_PERIOD: Final = MECHANICS.scan_period
FREE: Final = frozenset({OrderKind.IDLE, OrderKind.ATTACK_MOVE, OrderKind.SCAN_MOVE, OrderKind.PATROL, OrderKind.HOLD})


def look_out(world: World) -> None:
    """Make every unit with autocast use its abilities, in the order of slots."""
    if not world.autocast or world.loop % SCAN_PERIOD:
        return
    if world.casters is None:
        world.casters = _find_casters(world)
    for slot, abilities in world.casters:
        c = columns.columns_of(world)
        if c.alive[slot] and c.carrier[slot] == NOBODY and c.can_cast[slot] and not c.casts[slot]:
            _use_first_wanted(world, slot, abilities)


def _find_casters(world: World) -> list[tuple[int, tuple[int, ...]]]:
    """Return who may use which abilities by itself, by slot: those for which its player has the upgrades."""
    casters = []
    for slot, abilities in sorted(world.autocast.items()):
        owner = int(world.owner[slot])
        usable = tuple(number for number in abilities if not lacks_upgrade(world, owner, number))
        if usable:
            casters.append((slot, usable))
    return casters


def _use_first_wanted(world: World, slot: int, abilities: tuple[int, ...]) -> None:
    """Make a unit use the first of its abilities that its player would want now."""
    for number in abilities:
        if attempt(world, slot, casting.as_is(world, slot, world.catalog.ability(number))):
            return


def attempt(world: World, slot: int, ability: Ability) -> bool:
    """Make a unit use an ability if its player would want that now; return whether it does."""
    order = OrderKind(int(world.order_kind[slot]))
    cast = _choose(world, slot, ability) if ability.transient or order in FREE else None
    if cast is None or (order is OrderKind.HOLD and not casting.in_range(world, cast)):
        return False
    give = casting.skill_of(ability).give
    if give is not None:
        return bool(give(world, [slot], ability, world.tag_of(cast.target), None, False))
    if ability.transient:
        casting.perform(world, cast)
        return True
    waiting = ([] if order is OrderKind.IDLE else world.orders_of(slot)[:1]) + world.queue[slot]
    commands.begin(world, slot, Order(OrderKind.CAST, ability.id, target=world.tag_of(cast.target)))
    world.queue[slot] = waiting
    return True


def _choose(world: World, slot: int, ability: Ability) -> Cast | None:
    """Return the cast that a unit would make of an ability now, or None."""
    if casting.refusal(world, slot, ability) is not ActionResult.SUCCESS:
        return None
    pick = casting.skill_of(ability).pick
    target = (pick or nearest)(world, slot, ability)
    if (
        AbilityAim.UNIT not in ability.aim
        and ability.autocast_range
        and pick is None
        and not _is_tempted(world, slot, ability)
    ):
        return None
    cast = Cast(slot, ability, target, begun=world.loop)
    aimless = target == NOBODY and (ability.requires_point or pick is not None)
    return None if aimless or casting.aim_refusal(world, cast) is not ActionResult.SUCCESS else cast


def _is_tempted(world: World, slot: int, ability: Ability) -> bool:
    """Return whether a unit is near that triggers an untargeted autocast, such as coming out of the ground."""
    filters = ability.autocast_filters
    return any(
        casting.fits(world, slot, other, filters) is ActionResult.SUCCESS for other in _near(world, slot, ability)
    )


def nearest(world: World, slot: int, ability: Ability) -> int:
    """Return the nearest unit that autocast may choose and that the ability may be aimed at, or NOBODY."""
    if AbilityAim.UNIT not in ability.aim:
        return NOBODY
    for other in _near(world, slot, ability):
        if (
            other != slot
            and casting.fits(world, slot, other, ability.autocast_filters) is ActionResult.SUCCESS
            and casting.aim_refusal(world, Cast(slot, ability, other)) is ActionResult.SUCCESS
        ):
            return int(other)
    return NOBODY


def _near(world: World, slot: int, ability: Ability) -> list[int]:
    """Return the units that autocast considers, nearest first: no foes or no friends where the filters exclude them."""
    slots = world.live
    excluded = (*ability.filters.excluded, *ability.autocast_filters.excluded)
    if "Player" in excluded:
        slots = slots[world.owner[slots] != world.owner[slot]]
    if "Enemy" in excluded:
        slots = slots[(world.owner[slots] == world.owner[slot]) | (world.owner[slots] == 0)]
    offset = world.pos[slots] - world.pos[slot]
    gap = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) - world.radius[slots] - world.radius[slot]
    reach = ability.autocast_range or ability.range
    near: list[int] = slots[gap <= reach][np.argsort(gap[gap <= reach], kind="stable")].tolist()
    return near
