"""Skills of workers: gathering and returning. The orders are ``commands``', the round itself ``systems.harvest``'s."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.skill import Skill
from khala_simulator.economy import harvesting
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World


def _gather(world: World, slots: list[int], _: Ability, target: int, __: Point | None, queue: bool) -> list[int]:
    """Harvest a mineral field or a gas structure, and bring home the load, until another order comes."""
    return commands.gather(world, slots, target, queue=queue)


def _return(world: World, slots: list[int], _: Ability, __: int, ___: Point | None, queue: bool) -> list[int]:
    """Carry the load to the nearest town hall, and go on harvesting."""
    return commands.return_cargo(world, slots, queue=queue)


def _can_gather(world: World, cast: Cast) -> ActionResult:
    if cast.target == NOBODY or not world.unit_type(cast.target).resource:
        return ActionResult.MUST_TARGET_RESOURCES
    if harvesting.can_harvest(world, cast.slot, cast.target):
        return ActionResult.SUCCESS
    bare = world.owner[cast.target] == 0
    return ActionResult.MUST_BUILD_REFINERY_FIRST if bare else ActionResult.CANT_HARVEST_THAT_RESOURCE


def _can_return(world: World, cast: Cast) -> ActionResult:
    if not world.load[cast.slot]:
        return ActionResult.ERROR
    found = harvesting.nearest_hall(world, cast.slot) != NOBODY
    return ActionResult.SUCCESS if found else ActionResult.CANT_FIND_DROP_OFF


def _let_out(world: World, slot: int) -> None:
    """Release the workers inside a gas structure when it is destroyed."""
    for worker in world.passengers(slot):
        commands.begin(world, worker, None)


DEATHS: Final[dict[str, Callable[[World, int], None]]] = dict.fromkeys(
    ("Assimilator", "AssimilatorRich", "Extractor", "ExtractorRich", "Refinery", "RefineryRich"), _let_out
)
SKILLS: Final = {
    "gather": Skill(give=_gather, refuse=_can_gather),
    "return": Skill(give=_return, refuse=_can_return),
}
