"""The Corruptor's Caustic Spray: a channel on a structure that does more damage the longer it lasts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.skill import Skill, gap, number
from khala_simulator.combat import buffs
from khala_simulator.combat.damage import apply_damage

if TYPE_CHECKING:
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

CHANNELING = "ChannelingCausticSpray"


def _spray(world: World, cast: Cast) -> None:
    """Harm a structure again and again, and more after a while, until it dies or the Corruptor does something else."""
    buffs.apply(world, cast.slot, CHANNELING, source=cast.slot)


def _sprays(world: World, cast: Cast) -> bool:
    slot, target, ability = cast.slot, cast.target, cast.ability
    if world.order_target[slot] != target or gap(world, slot, target) > ability.range + ability.slop:
        return False
    period = number(cast, "period_loops")
    first = int(number(cast, "first_ticks"))
    before, ticks = ((world.loop - cast.begun - ago) / period for ago in (1, 0))
    for tick in range(int(before) + 1, int(ticks) + 1):
        damage = number(cast, "damage_per_tick_first" if tick <= first else "damage_per_tick_after")
        apply_damage(world, slot, int(world.owner[slot]), target, damage)
    return True


def _stops(world: World, cast: Cast) -> None:
    if world.alive[cast.slot]:
        buffs.remove(world, cast.slot, CHANNELING)


SKILLS: Final = {
    "caustic_spray": Skill(_spray, hold=_sprays, end=_stops, estimates=("The spray takes no time to arrive.",)),
}
