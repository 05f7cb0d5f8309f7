"""Snapshots: what a player remembers of structures and resources that the fog has covered.

A snapshot shows a unit as it was when it was last seen, with a tag of its own, and is forgotten when its place is seen
without it. Only immobile units leave one. ``fog`` keeps them up to date; on maps without fog there are none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.world.columns import Floats, Ints

TAG_BASE: Final = 2 << 32


@dataclass(frozen=True, slots=True)
class RememberedUnit:
    """A unit as it was last seen; ``tag`` is the snapshot's own, ``unit`` that of the unit itself."""

    tag: int
    unit: int
    row: int
    owner: int
    pos: tuple[float, float]
    heading: tuple[float, float]
    build_progress: float


class FogMemory:
    """The snapshots of one player, by the tag of the unit, and which of them the fog covers now."""

    def __init__(self) -> None:
        self.of_unit: dict[int, RememberedUnit] = {}
        self.shown: list[RememberedUnit] = []
        self.cells: NDArray[np.int64] = np.zeros(0, dtype=np.int64)  # of those, as numbers y * width + x
        self.made = 0
        self.noted: tuple[Ints, Floats] | None = None  # all that was in sight the last time, as it was; see ``fog``

    def find(self, tag: int) -> RememberedUnit | None:
        """Return the shown snapshot with this tag of its own, or None."""
        return next((snapshot for snapshot in self.shown if snapshot.tag == tag), None)
