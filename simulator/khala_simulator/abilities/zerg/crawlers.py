"""Crawlers take root again: on creep, where their footprint fits. Uprooting is an ordinary morph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.shared.push_units_off import push_units_off
from khala_simulator.abilities.skill import Skill, place_of
from khala_simulator.combat import lifecycle
from khala_simulator.economy import building_sites
from khala_simulator.tables.action_result import ActionResult

if TYPE_CHECKING:
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World


def _root(world: World, cast: Cast) -> None:
    """Take root at a place on creep."""
    if _room(world, cast) is not ActionResult.SUCCESS:
        return
    unit = world.catalog.unit(cast.ability.unit)
    teleport.to(world, cast.slot, building_sites.centre(world, unit, place_of(world, cast)))
    lifecycle.become(world, cast.slot, unit)
    push_units_off(world, cast.slot)


def _room(world: World, cast: Cast) -> ActionResult:
    owner = int(world.owner[cast.slot])
    unit = world.catalog.unit(cast.ability.unit)
    return building_sites.refusal(world, owner, unit, place_of(world, cast), on_site=cast.is_carried_out)


SKILLS: Final = {
    "root": Skill(_root, refuse=_room, binds=True),
}
