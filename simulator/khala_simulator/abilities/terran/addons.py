"""Skills of Terran structures: building a tech lab or a reactor at their side.

The add-on grows by itself; its structure makes nothing meanwhile. Lifting off, landing and taking over add-ons are
elsewhere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.skill import Skill
from khala_simulator.economy import building_sites, construction, production
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

OFFSET: Final = (2.5, -0.5)  # from a structure's middle to that of its add-on


def place_of(world: World, slot: int) -> Point:
    """Return where the add-on of a structure stands."""
    x, y = world.pos[slot].tolist()
    return x + OFFSET[0], y + OFFSET[1]


def _build(world: World, slots: list[int], ability: Ability, _: int, __: Point | None, ___: bool) -> list[int]:
    """Begin an add-on at the side of one structure."""
    slot = slots[0]
    owner = int(world.owner[slot])
    unit = world.catalog.unit(ability.unit)
    if building_sites.refusal(world, owner, unit, place_of(world, slot), on_site=True) is not ActionResult.SUCCESS:
        return []
    loops = ability.loops + construction.SEEN_LATER
    job = production.enqueue(world, slot, ability, makes=ability.unit, loops=loops)
    made = construction.begin(world, unit, owner, place_of(world, slot), loops=loops, paid=job.paid)
    job.kind = "addon"
    job.site = world.tag_of(made)
    job.paid = (0.0, 0.0)
    return [slot]


def _can_build(world: World, slot: int, ability: Ability) -> ActionResult:
    unit = building_sites.product(world, ability)
    if unit is None or world.unit_type(slot).flying:
        return ActionResult.NOT_SUPPORTED
    if world.addon[slot] != NOBODY:
        return ActionResult.CANT_BUILD_ON_THAT
    if slot in world.jobs:
        return ActionResult.CANT_QUEUE_THAT_ORDER
    return building_sites.refusal(world, int(world.owner[slot]), unit, place_of(world, slot))


SKILLS: Final = {
    "build_addon": Skill(
        give=_build,
        ready=_can_build,
        estimates=("A structure builds its add-on where it stands; it does not fly to another place for it.",),
    )
}
