"""Cancel: abilities that call off another one while it is being prepared or goes on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.abilities import commands
from khala_simulator.abilities.skill import Skill
from khala_simulator.tables.action_result import ActionResult

if TYPE_CHECKING:
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World


def cancelling(cancelled: str) -> Skill:
    """Return the skill that ends an order with the effect ``cancelled``; the next order in the queue begins."""

    def refuse(world: World, cast: Cast) -> ActionResult:
        used = world.catalog.ability_of_id.get(int(world.order_ability[cast.slot]))
        under_way = world.casts[cast.slot] and used is not None and used.effect == cancelled
        return ActionResult.SUCCESS if under_way else ActionResult.CANT_FIND_CANCEL_ORDER

    def effect(world: World, cast: Cast) -> None:
        """Call off what the unit is doing."""
        commands.begin_next(world, cast.slot)

    return Skill(effect, refuse=refuse)
