"""The Zerg's tables, joined from the modules of their groups."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import morphs
from khala_simulator.abilities.zerg import (
    banelings,
    broods,
    corruptors,
    crawlers,
    infestors,
    larvae,
    lurkers,
    nydus,
    overlords,
    queens,
    ravagers,
    swarmhosts,
    vipers,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.abilities.skill import AreaEffectRule, BuffRule, Skill, UnitRule
    from khala_simulator.world.world import World

SKILLS: Final[dict[str, Skill]] = {
    **banelings.SKILLS,
    **corruptors.SKILLS,
    **crawlers.SKILLS,
    **morphs.SKILLS,
    **infestors.SKILLS,
    **larvae.SKILLS,
    **lurkers.SKILLS,
    **overlords.SKILLS,
    **queens.SKILLS,
    **ravagers.SKILLS,
    **swarmhosts.SKILLS,
    **vipers.SKILLS,
}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {
    **broods.AREA_EFFECTS,
    **infestors.AREA_EFFECTS,
    **larvae.AREA_EFFECTS,
    **ravagers.AREA_EFFECTS,
    **swarmhosts.AREA_EFFECTS,
    **vipers.AREA_EFFECTS,
}
TICKS: Final[dict[str, BuffRule]] = {
    **infestors.TICKS,
    **queens.TICKS,
    **vipers.TICKS,
}
ENDS: Final[dict[str, BuffRule]] = {
    **infestors.ENDS,
    **larvae.ENDS,
}
FINALS: Final[dict[str, BuffRule]] = {
    **vipers.FINALS,
}
PASSIVES: Final[dict[str, UnitRule]] = {
    **larvae.PASSIVES,
    **nydus.PASSIVES,
    **overlords.PASSIVES,
    **queens.PASSIVES,
}
DEATHS: Final[dict[str, Callable[[World, int], None]]] = {
    **banelings.DEATHS,
    **broods.DEATHS,
}
