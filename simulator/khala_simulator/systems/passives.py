"""Passives: what units do by their nature, in every loop, without an order."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.abilities.registry import PASSIVES

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def run(world: World) -> None:
    """Run the rule of every type that has one, for all living units of the type."""
    if world.passive_units_at != world.population:
        _look_over(world)
    for name, slots in world.passive_units.items():
        PASSIVES[name](world, slots)


def _look_over(world: World) -> None:
    """List the units whose types have a rule, after a unit came or went."""
    world.passive_units_at, world.passive_units = world.population, {}
    for slot in world.live.tolist():
        name = world.unit_type(slot).name
        if name in PASSIVES:
            world.passive_units.setdefault(name, []).append(slot)
