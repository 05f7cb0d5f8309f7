"""A Nydus worm is hard to kill while it comes up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.combat import buffs

if TYPE_CHECKING:
    from khala_simulator.world.world import World

SHELL = "NydusWormArmor"


def _harden(world: World, slots: list[int]) -> None:
    """Give extra armor to every unfinished worm, and to no other."""
    for slot in slots:
        rises = world.build_progress[slot] < 1.0
        if rises and not buffs.has(world, slot, SHELL):
            buffs.apply(world, slot, SHELL)
        elif not rises and buffs.has(world, slot, SHELL):
            buffs.remove(world, slot, SHELL)


PASSIVES: Final = {"NydusCanal": _harden}
