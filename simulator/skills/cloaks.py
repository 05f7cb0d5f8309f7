"""Cloaks: Ghosts and Banshees that hide from everybody but detectors as long as their energy lasts.

Energy drains by the buff's own negative rate (``systems.regeneration``). The Mothership's field is another module's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from simulator import buffs
from simulator.refusal import Refusal
from simulator.skills.basics import off_self, on_self
from simulator.skills.skill import Skill

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from simulator.casts import Cast
    from simulator.skills.skill import BuffRule
    from simulator.world import World


def _unless(buff: str) -> Callable[[World, Cast], Refusal]:
    """Refuse a caster that bears the buff already."""
    return lambda world, cast: Refusal.ERROR if buffs.has(world, cast.slot, buff) else Refusal.SUCCESS


def _with(buff: str) -> Callable[[World, Cast], Refusal]:
    """Refuse a caster that does not bear the buff."""
    return lambda world, cast: Refusal.SUCCESS if buffs.has(world, cast.slot, buff) else Refusal.ERROR


def _uncloak_exhausted(world: World, slot: int, row: np.void) -> None:
    if world.energy[slot] <= 0.0:
        buffs.remove(world, slot, world.catalog.buffs[int(row["buff"])].name)


SKILLS: Final = {
    "ghost_cloak_on": Skill(on_self("GhostCloak"), refuse=_unless("GhostCloak")),
    "ghost_cloak_off": Skill(off_self("GhostCloak"), refuse=_with("GhostCloak")),
    "banshee_cloak_on": Skill(on_self("BansheeCloak"), refuse=_unless("BansheeCloak")),
    "banshee_cloak_off": Skill(off_self("BansheeCloak"), refuse=_with("BansheeCloak")),
}
TICKS: Final[dict[str, BuffRule]] = {"GhostCloak": _uncloak_exhausted, "BansheeCloak": _uncloak_exhausted}
