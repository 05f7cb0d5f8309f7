"""The burrowed Lurker's hold fire: it picks no target by itself until fire is allowed again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import buffs

if TYPE_CHECKING:
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

HELD = "LurkerHoldFireB"


def _hold_fire(world: World, cast: Cast) -> None:
    """Attack only on order."""
    buffs.apply(world, cast.slot, HELD, source=cast.slot)


def _fire_at_will(world: World, cast: Cast) -> None:
    """Attack any enemy that comes near again."""
    buffs.remove(world, cast.slot, HELD)


SKILLS: Final = {
    "lurker_hold_fire": Skill(_hold_fire),
    "lurker_remove_hold_fire": Skill(_fire_at_will),
}
