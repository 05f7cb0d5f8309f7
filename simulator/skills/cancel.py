"""Cancel: abilities that call off another one while it is being prepared or goes on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simulator import commands
from simulator.action_result import ActionResult
from simulator.skills.skill import Skill

if TYPE_CHECKING:
    from simulator.casts import Cast
    from simulator.world import World


def cancelling(does: str) -> Skill:
    """The skill that ends a unit's order to use an ability that ``does`` this; what waits behind it begins."""

    def refuse(world: World, cast: Cast) -> ActionResult:
        current = world.casts[cast.slot] and world.catalog.ability(int(world.order_ability[cast.slot])).does == does
        return ActionResult.SUCCESS if current else ActionResult.CANT_FIND_CANCEL_ORDER

    def effect(world: World, cast: Cast) -> None:
        """Call off what the unit is doing."""
        commands.begin_next(world, cast.slot)

    return Skill(effect, refuse=refuse)
