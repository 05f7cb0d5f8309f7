"""Power: checked when a unit comes or goes, is finished, or changes its kind."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.combat.traits import refresh
from khala_simulator.economy import power

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def run(world: World) -> None:
    """Write which structures have power, if anything changed since the last time."""
    if world.powered_at == world.population:
        return
    world.powered_at = world.population
    for slot in power.supply(world):
        refresh(world, slot)
