"""What a computer player knows of its enemies: what it sees, and the structures that it remembers.

A level that cheats by vision knows everything. What anything is worth in a fight is its price, times the part of its
life that is left.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.opponent.levels import FASTER_LOOPS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.casts import Point
    from khala_simulator.world.columns import Bools, Floats, Ints
    from khala_simulator.world.world import World

REMEMBERED_S: Final = 90.0
"""For how long units that went out of sight count as still there."""
WORKER_VALUE: Final = 18.0
"""A worker fights worse than its price: with half the damage of a Marine and no range it is a third of one."""
VESPENE: Final = 1.2
"""A unit of vespene counts as so many minerals."""
A_BUNKER: Final = 250.0
"""With the Marines in it, which no enemy sees."""


class Enemy:
    """The enemies of a side, as it knows them in one thought."""

    def __init__(self, side: OwnSide) -> None:
        world = side.world
        self.side = side
        live = world.live
        foes = live[(world.owner[live] > 0) & (world.owner[live] != side.player)]
        self.sees_all = side.level.vision
        self.known: Ints = foes if self.sees_all else foes[world.visible[side.player, foes]]
        structure = _structures(world.catalog)[world.type[self.known]]
        self.units: Ints = self.known[~structure]
        self.structures: Ints = self.known[structure]
        self.fighters: Ints = self.known[values_of(world.catalog)[world.type[self.known]] > 0.0]
        self._remember()

    def _remember(self) -> None:
        """Note the fighting units in sight; forget those that have not been seen for long."""
        world, seen = self.side.world, self.side.mind.seen
        fights = values_of(world.catalog)[world.type[self.units]] > WORKER_VALUE
        for slot in self.units[fights].tolist():
            seen[world.tag_of(slot)] = int(world.type[slot]), world.loop
        until = world.loop - REMEMBERED_S * FASTER_LOOPS
        for tag in [tag for tag, (_, loop) in seen.items() if loop < until or world.slot_of(tag) < 0]:
            del seen[tag]

    def army_supply(self) -> float:
        """Return the supply of the fighting units that it knows of."""
        units = self.side.world.catalog.units
        return sum(units[row].supply for row, _ in self.side.mind.seen.values())

    def places(self) -> Floats:
        """Return (k, 2) where enemy structures stand, as far as it knows."""
        world, player = self.side.world, self.side.player
        here = world.pos[self.structures]
        memory = world.memories[player].shown
        there = [s.pos for s in memory if s.owner not in (0, player) and world.catalog.units[s.row].structure]
        return np.vstack([here, np.array(there, dtype=np.float64).reshape(-1, 2)])

    def near(self, point: Point, radius: float) -> Ints:
        """Return the enemies in sight within a radius that can fight."""
        world = self.side.world
        offset = world.pos[self.fighters] - np.array(point)
        found: Ints = self.fighters[offset[:, 0] ** 2 + offset[:, 1] ** 2 <= radius**2]
        return found


def value(world: World, slots: Iterable[int] | Ints) -> float:
    """Return what units are worth in a fight."""
    at = np.asarray(slots if isinstance(slots, np.ndarray) else list(slots), dtype=np.int64)
    if not at.size:
        return 0.0
    whole = np.maximum(world.life_max[at] + world.shields_max[at], 1.0)
    left = (world.life[at] + world.shields[at]) / whole
    done = np.where(world.build_progress[at] >= 1.0, 1.0, 0.0)
    return float((values_of(world.catalog)[world.type[at]] * done * (0.4 + 0.6 * left)).sum())


@lru_cache(maxsize=4)
def values_of(catalog: Catalog) -> Floats:
    """Return, by unit row, what a type is worth in a fight; 0 for what does not fight."""
    found = np.zeros(len(catalog.units))
    for unit in catalog.units:
        armed = any(weapon.works for weapon in unit.weapons)
        if unit.worker:
            found[unit.row] = WORKER_VALUE
        elif (unit.army or armed) and not unit.not_in_melee:
            found[unit.row] = unit.cost[0] + VESPENE * unit.cost[1]
        elif unit.name == "Bunker":
            found[unit.row] = A_BUNKER
    return found


@lru_cache(maxsize=4)
def _structures(catalog: Catalog) -> Bools:
    return np.array([unit.structure for unit in catalog.units], dtype=np.bool_)
