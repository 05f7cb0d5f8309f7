"""Terran: the tables of all modules with Terran skills, joined."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from simulator.damage import IMPACTS
from simulator.skills import (
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
    projectiles,
    ravens,
    repair,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from simulator.skills.skill import BuffRule, FieldRule, Skill, SmartRule, UnitRule
    from simulator.world import World

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
FIELDS: Final[dict[str, FieldRule]] = {
    **cyclone.FIELDS,
    **projectiles.FIELDS,
    **infantry.FIELDS,
    **liberators.FIELDS,
    **nukes.FIELDS,
    **orbital.FIELDS,
    **ravens.FIELDS,
}
TICKS: Final[dict[str, BuffRule]] = {**buildings.TICKS, **cloaks.TICKS, **ghosts.TICKS}
ENDS: Final[dict[str, BuffRule]] = {**buildings.ENDS, **orbital.ENDS}
PASSIVES: Final[dict[str, UnitRule]] = {**buildings.PASSIVES, **mines.PASSIVES}
DEATHS: Final[dict[str, Callable[[World, int], None]]] = orbital.DEATHS
SMARTS: Final[tuple[SmartRule, ...]] = (*repair.SMARTS, *mines.SMARTS)

IMPACTS.update(infantry.IMPACTS)
