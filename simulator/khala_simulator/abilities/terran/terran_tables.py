"""Terran: the tables of all modules with Terran abilities, joined."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import projectiles
from khala_simulator.abilities.terran import (
    battlecruiser,
    buildings,
    cloaks,
    cyclone,
    ghosts,
    infantry,
    landing,
    liberators,
    medivacs,
    mines,
    nukes,
    orbital,
    ravens,
    repair,
)
from khala_simulator.combat.damage import IMPACTS

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.abilities.skill import AreaEffectRule, BuffRule, Skill, SmartRule, UnitRule
    from khala_simulator.world.world import World

SKILLS: Final[dict[str, Skill]] = {
    **buildings.SKILLS,
    **cloaks.SKILLS,
    **cyclone.SKILLS,
    **ghosts.SKILLS,
    **infantry.SKILLS,
    **landing.SKILLS,
    **liberators.SKILLS,
    **medivacs.SKILLS,
    **mines.SKILLS,
    **nukes.SKILLS,
    **orbital.SKILLS,
    **ravens.SKILLS,
    **repair.SKILLS,
    **battlecruiser.SKILLS,
}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {
    **cyclone.AREA_EFFECTS,
    **projectiles.AREA_EFFECTS,
    **infantry.AREA_EFFECTS,
    **liberators.AREA_EFFECTS,
    **nukes.AREA_EFFECTS,
    **orbital.AREA_EFFECTS,
    **ravens.AREA_EFFECTS,
}
TICKS: Final[dict[str, BuffRule]] = {**buildings.TICKS, **cloaks.TICKS, **ghosts.TICKS}
ENDS: Final[dict[str, BuffRule]] = {**buildings.ENDS, **orbital.ENDS}
PASSIVES: Final[dict[str, UnitRule]] = {**buildings.PASSIVES, **mines.PASSIVES}
DEATHS: Final[dict[str, Callable[[World, int], None]]] = orbital.DEATHS
SMARTS: Final[tuple[SmartRule, ...]] = (*repair.SMARTS, *mines.SMARTS)

IMPACTS.update(infantry.IMPACTS)
