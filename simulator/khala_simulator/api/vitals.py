"""Vitals: what an observation says of chosen units in numbers, rounded to the 32 bits that a message has for each.

A table of vitals has a row for each number, see `vital_rows`, and a column for each unit. Above:
`khala_simulator.battle`, `khala_simulator.smac`. Below: the world's columns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.api.vital_rows import COOLDOWN, ENERGY, LIFE, LIFE_MAX, SHIELDS, SHIELDS_MAX, X, Y
from khala_simulator.combat import tags
from khala_simulator.native import columns, memory
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from khala_simulator.api.types import Types
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.world.world import World


def look(
    world: World,
    types: Types,
    tags: NDArray[np.int64],
    there: NDArray[np.bool_],
    numbers: NDArray[np.float64],
) -> None:
    """Write which units are in the world and not inside another one, and the numbers of these.

    Args:
        world: The world.
        types: The tables of the API.
        tags: (n,) of the units.
        there: (n,) which of them are there; written for each.
        numbers: (8, n) written for those that are there.
    """
    reader = Reader(world, types)
    tag = memory.ints(tags)
    found = memory.bools(there)
    cells = memory.floats(numbers)
    n = len(tags)
    for i in range(n):
        slot = reader.find(tag[i])
        found[i] = slot != NOBODY
        if slot != NOBODY:
            reader.read(slot, cells, n, i)


class Reader:
    """Reads the vitals of units of one world; it holds until the world grows or an upgrade is done."""

    def __init__(self, world: World, types: Types) -> None:
        stats = world.stats
        self.arrays = stats.life_max, stats.shields_max, types.armed
        self.c = columns.columns_of(world)
        self.types = len(types.id)
        self.life_max = memory.floats(stats.life_max)
        self.shields_max = memory.floats(stats.shields_max)
        self.armed = memory.bools(types.armed)

    def find(self, tag: int) -> int:
        """Return the slot of a unit, or NOBODY if it is not in the world."""
        slot = tags.slot_of(self.c, tag)
        return slot if slot != NOBODY and self.c.carrier[slot] == NOBODY else NOBODY

    def read(self, slot: int, numbers: Cells, n: int, i: int) -> None:
        """Write the numbers of the unit in a slot into a column of a table with n columns."""
        c: Columns = self.c
        at = c.owner[slot] * self.types + c.type[slot]
        cooldown = max(c.cooldown[slot], 0.0) if self.armed[c.type[slot]] else 0.0
        numbers[X * n + i] = memory.single(c.pos[slot].x)
        numbers[Y * n + i] = memory.single(c.pos[slot].y)
        numbers[LIFE * n + i] = memory.single(c.life[slot])
        numbers[LIFE_MAX * n + i] = memory.single(self.life_max[at])
        numbers[SHIELDS * n + i] = memory.single(c.shields[slot])
        numbers[SHIELDS_MAX * n + i] = memory.single(self.shields_max[at])
        numbers[ENERGY * n + i] = memory.single(c.energy[slot])
        numbers[COOLDOWN * n + i] = memory.single(cooldown)
