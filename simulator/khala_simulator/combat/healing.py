"""Healing: life that a unit gets back; a unit with none left stays dead.

The counterpart of ``damage``. A unit that loses its life in a loop is in the world until ``systems.death`` runs, and
whatever would heal it until then comes too late. Above: everything that heals or repairs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from khala_simulator.world.world import World

WHOLE: Final = 1e-9  # life that may be missing from a unit that is healed


def is_hurt(world: World, slot: int) -> bool:
    """Return whether a unit lives and lacks life."""
    return bool(0.0 < world.life[slot] < world.life_max[slot] - WHOLE)


def heal(world: World, slot: int, amount: float) -> float:
    """Give a living unit life, up to what its type holds, and count it for its owner; return how much it got."""
    if not is_hurt(world, slot):
        return 0.0
    healed = min(amount, float(world.life_max[slot] - world.life[slot]))
    world.life[slot] += healed
    world.players[int(world.owner[slot])].score.healed.life += healed
    return healed
