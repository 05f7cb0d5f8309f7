"""Shots under way: missiles in flight and hits that are due later.

Two small tables of exactly as many rows as there are shots, and a list of the sweeps under way. ``systems.weapons``
adds to them, ``systems.hits``, ``missiles`` and ``sweeps`` remove from them. A reference to a unit that died becomes
-1; the shot keeps its last point.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Final, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.numeric.geometry import Floats

    Ints = NDArray[np.int64]

NOBODY: Final = -1

_SHOT: Final = [
    ("source", np.int64),  # slot of the attacker, or NOBODY
    ("owner", np.int64),  # owner of the attacker
    ("target", np.int64),  # slot of the target, or NOBODY
    ("prior", np.int64),  # slot from which a bounce came, or NOBODY
    ("weapon", np.int64),  # row in catalog.weapons
    ("hit", np.int64),  # index in the weapon's hits
    ("start", np.float64, 2),  # where the attacker stood
    ("goal", np.float64, 2),  # where the target is, or was when it died
]


class Shot(NamedTuple):
    """One row of either table as Python values."""

    source: int
    owner: int
    target: int
    prior: int
    weapon: int
    hit: int
    start: tuple[float, float]
    goal: tuple[float, float]


def shots_of(rows: NDArray[np.void]) -> list[Shot]:
    """Return the shots in some rows of either table."""
    numbers = (rows[name].tolist() for name in Shot._fields[:6])
    points = ([(x, y) for x, y in rows[name].tolist()] for name in Shot._fields[6:])
    return [Shot(*values) for values in zip(*numbers, *points, strict=True)]


@dataclass(slots=True)
class Sweep:
    """A sweep that is under way: its shot, the (fractional) loop it began at, the next point, the touched units."""

    shot: Shot
    begun: float
    ahead: int
    touched: list[int]

    def forget(self, slot: int) -> None:
        """Drop references to the unit in ``slot``, which is gone."""
        self.touched = [other for other in self.touched if other != slot]
        self.shot = self.shot._replace(
            source=NOBODY if self.shot.source == slot else self.shot.source,
            target=NOBODY if self.shot.target == slot else self.shot.target,
        )


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
        """Drop references to the unit in ``slot``, which is gone."""
        for name in ("source", "target", "prior"):
            column = self.rows[name]
            column[column == slot] = NOBODY

    def content(self) -> bytes:
        """Return all rows as bytes, for the digest of the world."""
        return self.rows.tobytes()


class Missiles(_Table):
    """Missiles in flight: where they are, and their speed in world units per loop."""

    dtype = np.dtype([*_SHOT, ("pos", np.float64, 2), ("step", np.float64), ("top", np.float64), ("gain", np.float64)])


class PendingHits(_Table):
    """Hits that fall due at a later loop.

    ``due`` is that loop with its fraction. ``single`` marks damage to the target alone, by a sweep that touched it.
    """

    dtype = np.dtype([*_SHOT, ("due", np.float64), ("single", np.bool_)])
