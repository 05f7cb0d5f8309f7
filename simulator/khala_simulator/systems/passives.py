"""Passives: what units do by their nature, in every loop, without an order."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.abilities.registry import PASSIVES

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Bools
    from khala_simulator.world.world import World


def run(world: World) -> None:
    """Run the rule of every type that has one, for all living units of the type."""
    if world.natures_at != world.population:
        _look_over(world)
    for name, slots in world.natures:
        PASSIVES[name](world, slots)


def _look_over(world: World) -> None:
    """List the units whose types have a rule, after a unit came or went."""
    world.natures_at = world.population
    of_type: dict[str, list[int]] = {}
    slots = world.live[_has_rule(world.catalog).take(world.type.take(world.live))]
    for slot in slots.tolist():
        of_type.setdefault(world.unit_type(slot).name, []).append(slot)
    world.natures = list(of_type.items())


@lru_cache(maxsize=4)
def _has_rule(catalog: Catalog) -> Bools:
    """Return, by unit row, which types have a rule."""
    return np.array([unit.name in PASSIVES for unit in catalog.units])
