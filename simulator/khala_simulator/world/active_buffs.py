"""Active buffs: which units have which buffs, a row each.

Only the table: ``buffs`` adds and removes rows, ``systems.buffs`` removes those that run out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from numpy.typing import NDArray

FOREVER: Final = 1 << 40  # end of a buff that does not run out

ROW: Final = np.dtype(
    [
        ("slot", np.int64),  # the unit that has it
        ("buff", np.int64),  # row in catalog.buffs
        ("source", np.int64),  # slot of the caster, or NOBODY
        ("owner", np.int64),  # owner of the caster
        ("begun", np.int64),  # loop
        ("end", np.float64),  # loop, FOREVER without an end
        ("due", np.float64),  # loop of the next period, FOREVER without one
        ("count", np.int64),  # stacks, or ticks done: the skill's own counter
    ]
)


class ActiveBuffs:
    """The buffs in force, a row each, in the order in which they came."""

    def __init__(self) -> None:
        self._rows = np.zeros(0, dtype=ROW)
        self._first: dict[tuple[int, int], int] | None = None  # (slot, kind) -> its first row, for ``find``
        self._quiet_until = float(FOREVER)  # the loop before which no period and no end comes, for ``any_due``

    @property
    def rows(self) -> NDArray[np.void]:
        """(k,) the table; no unit or kind in it changes, and a period or an end is only put off."""
        return self._rows

    def add(self, row: tuple[float, ...]) -> None:
        """Add a row."""
        fresh = np.array([row], dtype=ROW)
        self._rows = np.concatenate((self._rows, fresh))
        self._first = None
        self._quiet_until = min(self._quiet_until, float(fresh["due"][0]), float(fresh["end"][0]))

    def keep(self, kept: NDArray[np.bool_]) -> None:
        """Remove all rows but those."""
        self._rows = self._rows[kept]
        self._first = None

    def __len__(self) -> int:
        return len(self._rows)

    def of(self, slot: int) -> NDArray[np.void]:
        """Return the rows of a unit."""
        found: NDArray[np.void] = self.rows[self.rows["slot"] == slot]
        return found

    def find(self, slot: int, row: int) -> int:
        """Return the index of the first row of a kind on a unit, or -1."""
        if self._first is None:
            kinds = zip(self.rows["slot"].tolist(), self.rows["buff"].tolist(), strict=True)
            self._first = {}
            for index, kind in enumerate(kinds):
                self._first.setdefault(kind, index)
        return self._first.get((slot, row), -1)

    def any_due(self, loop: int) -> bool:
        """Return whether a period or an end has come."""
        if loop < self._quiet_until:
            return False
        rows = self._rows
        self._quiet_until = min(float(rows["due"].min()), float(rows["end"].min())) if len(rows) else FOREVER
        return loop >= self._quiet_until

    def forget(self, slot: int) -> None:
        """Remove the buffs on a unit that is gone; buffs that it cast stay."""
        if len(self.rows):
            self.keep(self.rows["slot"] != slot)
            source = self.rows["source"]
            source[source == slot] = NOBODY

    def content(self) -> bytes:
        """Return all rows as bytes, for the digest of the world."""
        return self.rows.tobytes()
