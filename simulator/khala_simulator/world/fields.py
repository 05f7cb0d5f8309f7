"""The fields of a world that rules ask for in every loop; in compiled rules they are those of a C structure.

``fields.pxd`` lists them all with their types, because reading one by its name would cost more than many a rule. Those
that are set here are notes: what the world keeps so that the systems need not look at every unit in every loop. A note
follows from the state and is written again when a unit comes, goes or changes; it is no part of the world's digest, and
says for which ``population`` it holds. Values that only a layer above understands are of type ``object`` here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.world.columns import Bools, Ints


class WorldFields:
    """Notes between changes of the population; ``World`` sets the others."""

    def __init__(self) -> None:
        self.population = 0  # counts births and deaths, for what is worth remembering between them
        self.looked_at = -1  # the population for which ``visible`` was written
        self.resting_version = -1  # the population among which no body touched another when all last stood still
        self.bodies: object | None = None  # room for what is measured between them, for ``contacts``
        self.steps: object | None = None  # room for the steps of those that walk, for ``movement``
        self.foes: object | None = None  # room for those at whom a player may aim, for ``acquire``
        self.crowd: object | None = None  # room for the bodies that are in the way of others, for ``avoidance``
        self.census: object | None = None  # of this population, for ``census``
        self.casters: list[tuple[int, tuple[int, ...]]] | None = None  # who may use what by itself, for ``autocast``
        self.bare_at = -1  # the population in which nothing makes creep or needs it
        self.tally: NDArray[np.int64] | None = None  # how many of each type each player has, for ``requirements``
        self.tallied = -1  # the loop in which that was counted
        self.regenerating = (False, False, False)  # whether any unit regains shields, life, energy
        self.harvesting = False  # whether any unit harvests
        self.mortal = False  # whether any unit's life is timed
        self.hiding = False  # whether any unit is cloaked or burrowed
        self.natures: list[tuple[str, list[int]]] = []  # types with a nature, and their slots, for ``passives``
        self.natures_at = -1  # the population for which this was written
        self.opponents: tuple[int, ...] | None = None  # computer players that lead a side, once looked up
        self.taken: tuple[int, Bools] | None = None  # the cells with structures on them, and for which population
        self.eyes: object | None = None  # with what the players saw last, for ``vision``
        self.powered_at = -1  # the population for which ``powered`` was written
        self.fighters: Ints = np.zeros(0, dtype=np.int64)  # slots with a target, as of this loop's measuring
        self.anyone_moved = True  # a unit walked in the last loop
        self.orders_changed = True  # a unit got an order, was born or died since orders were last checked
