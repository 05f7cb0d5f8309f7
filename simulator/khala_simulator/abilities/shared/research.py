"""The skill of research: an upgrade in a structure's queue, once per player."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared.production import has_place
from khala_simulator.abilities.skill import Skill
from khala_simulator.economy import production
from khala_simulator.tables.action_result import ActionResult

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World


def _research(world: World, slots: list[int], ability: Ability, _: int, __: Point | None, ___: bool) -> list[int]:
    """Put an upgrade into the queue of one structure."""
    slot = min(slots, key=lambda s: (len(world.jobs.get(s, ())), s))
    production.enqueue(world, slot, ability, makes=ability.upgrade, loops=ability.loops)
    return [slot]


def _can_research(world: World, slot: int, ability: Ability) -> ActionResult:
    player = world.players[int(world.owner[slot])]
    upgrade = next((u for u in world.catalog.upgrades if u.name == ability.upgrade), None)
    if upgrade is None or not ability.loops:
        return ActionResult.NOT_SUPPORTED
    if upgrade.id in player.upgrades or upgrade.name in player.underway:
        return ActionResult.TECH_REQUIREMENTS_NOT_MET
    return has_place(world, slot, ability)


SKILLS: Final = {"research": Skill(give=_research, ready=_can_research)}
