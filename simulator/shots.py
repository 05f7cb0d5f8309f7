"""What has left a weapon and not yet arrived: missiles in flight and hits that are due later.

Two small tables of exactly as many rows as there are shots. ``systems.weapons`` adds to them, ``systems.missiles``
and ``systems.damage`` take from them. A reference to a unit that died becomes -1; the shot keeps its last point.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from simulator.geometry import Floats

    Ints = NDArray[np.int64]

NOBODY: Final = -1

_SHOT: Final = [
    ("source", np.int64),  # slot of the attacker, or NOBODY
    ("owner", np.int64),  # whose unit fired
    ("target", np.int64),  # slot of the target, or NOBODY
    ("weapon", np.int64),  # row in catalog.weapons
    ("hit", np.int64),  # index in the weapon's hits
    ("start", np.float64, 2),  # where the attacker stood
    ("goal", np.float64, 2),  # where the target is, or was when it died
]


class _Table:
    """Rows of one structured array, appended to and cut by mask."""

    dtype: ClassVar[np.dtype[np.void]]

    def __init__(self) -> None:
        self.rows: NDArray[np.void] = np.zeros(0, dtype=self.dtype)

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def target(self) -> Ints:
        """(rows,) slot of each target, or NOBODY."""
        return self.rows["target"]

    @property
    def goal(self) -> Floats:
        """(rows, 2) where each target is, or was when it died."""
        return self.rows["goal"]

    def append(self, count: int, **columns: object) -> None:
        """Add ``count`` rows; each column is given as one value for all or one per row."""
        old = len(self.rows)
        rows = np.zeros(old + count, dtype=self.dtype)
        rows[:old] = self.rows
        new = rows[old:]
        for name, values in columns.items():
            new[name] = values
        self.rows = rows

    def keep(self, mask: NDArray[np.bool_]) -> None:
        """Drop the rows where ``mask`` is false."""
        self.rows = self.rows[mask]

    def forget(self, slot: int) -> None:
        """The unit in ``slot`` is gone."""
        for name in ("source", "target"):
            column = self.rows[name]
            column[column == slot] = NOBODY

    def content(self) -> bytes:
        """All rows as bytes, for the digest of the world."""
        return self.rows.tobytes()


class Missiles(_Table):
    """Missiles in flight: where they are, and their speed in world units per loop."""

    dtype = np.dtype([*_SHOT, ("pos", np.float64, 2), ("step", np.float64), ("top", np.float64), ("gain", np.float64)])


class PendingHits(_Table):
    """Hits that fall due at a later loop.

    ``due`` is that loop with its fraction. ``single`` marks damage to the target alone, whose splash or sweep is
    already resolved.
    """

    dtype = np.dtype([*_SHOT, ("due", np.float64), ("single", np.bool_)])
