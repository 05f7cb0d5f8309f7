"""Cloaks: Ghosts and Banshees hide from all but detectors as long as their energy lasts.

Energy drains by the buff's own negative rate (``systems.regeneration``). The Mothership's field is in ``mothership``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared.basics import off_self, on_self
from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from khala_simulator.abilities.skill import BuffRule, Effect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World


def _unless(buff: str) -> Callable[[World, Cast], ActionResult]:
    """Refuse a caster that bears the buff already."""
    return lambda world, cast: ActionResult.ERROR if buffs.has(world, cast.slot, buff) else ActionResult.SUCCESS


def _with(buff: str) -> Callable[[World, Cast], ActionResult]:
    """Refuse a caster that does not bear the buff."""
    return lambda world, cast: ActionResult.SUCCESS if buffs.has(world, cast.slot, buff) else ActionResult.ERROR


def _cloak(buff: str) -> Effect:
    def effect(world: World, cast: Cast) -> None:
        """Be seen by detectors only, as long as the energy lasts."""
        on_self(buff)(world, cast)

    return effect


def _uncloak(buff: str) -> Effect:
    def effect(world: World, cast: Cast) -> None:
        """Be seen again, and save the energy."""
        off_self(buff)(world, cast)

    return effect


def _uncloak_exhausted(world: World, slot: int, row: np.void) -> None:
    if world.energy[slot] <= 0.0:
        buffs.remove(world, slot, world.catalog.buffs[int(row["buff"])].name)


SKILLS: Final = {
    "ghost_cloak_on": Skill(_cloak("GhostCloak"), refuse=_unless("GhostCloak")),
    "ghost_cloak_off": Skill(_uncloak("GhostCloak"), refuse=_with("GhostCloak")),
    "banshee_cloak_on": Skill(_cloak("BansheeCloak"), refuse=_unless("BansheeCloak")),
    "banshee_cloak_off": Skill(_uncloak("BansheeCloak"), refuse=_with("BansheeCloak")),
}
TICKS: Final[dict[str, BuffRule]] = {"GhostCloak": _uncloak_exhausted, "BansheeCloak": _uncloak_exhausted}
