"""Passives: what units do by their nature, in every loop, without an order."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.abilities.registry import OF_BUFFS, PASSIVES
from khala_simulator.native import columns, memory

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Bools
    from khala_simulator.world.world import World


def run(world: World) -> None:
    """Run the rule of every type that has one, for all living units of the type."""
    if world.natures_at != world.population:
        _look_over(world)
    if not world.natures:
        return
    anyone_has_buffs = len(world.buffs) > 0
    for name, slots in world.natures:
        if anyone_has_buffs or name not in OF_BUFFS:
            PASSIVES[name](world, slots)


def _look_over(world: World) -> None:
    """List the units whose types have a rule, after a unit came or went."""
    world.natures_at = world.population
    c = columns.columns_of(world)
    has_rule = _has_rule(world.catalog)
    ruled = memory.bools(has_rule)
    live = world.live
    slots = memory.ints(live)
    of_type: dict[str, list[int]] = {}
    for i in range(len(live)):
        slot = slots[i]
        if ruled[c.type[slot]]:
            of_type.setdefault(world.unit_type(slot).name, []).append(slot)
    world.natures = list(of_type.items())


@lru_cache(maxsize=4)
def _has_rule(catalog: Catalog) -> Bools:
    """Return, by unit row, which types have a rule."""
    return np.array([unit.name in PASSIVES for unit in catalog.units])
