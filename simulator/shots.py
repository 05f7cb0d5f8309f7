"""What has left a weapon and not yet arrived: missiles in flight and hits that are due later.

Two small tables of exactly as many rows as there are shots. ``systems.weapons`` adds to them, ``systems.missiles``
and ``systems.damage`` take from them. A reference to a unit that died becomes -1; the shot keeps its last point.
"""

from __future__ import annotations

from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
NOBODY: Final = -1


class _Table:
    """Columns of equal length, appended to by row and cut by mask."""

    columns: ClassVar[tuple[tuple[str, type, int], ...]]

    source: Ints
    target: Ints

    def __init__(self) -> None:
        for name, dtype, width in self.columns:
            setattr(self, name, np.zeros((0, width) if width else 0, dtype=dtype))

    def __len__(self) -> int:
        return len(self.source)

    def append(self, count: int, **rows: object) -> None:
        """Add ``count`` rows; every column must be given, as one value for all or one per row."""
        for name, dtype, width in self.columns:
            shape = (count, width) if width else (count,)
            new: NDArray[np.generic] = np.broadcast_to(np.asarray(rows[name], dtype=dtype), shape)
            setattr(self, name, np.concatenate([getattr(self, name), new]))

    def keep(self, mask: NDArray[np.bool_]) -> None:
        """Drop the rows where ``mask`` is false."""
        for name, _, _ in self.columns:
            setattr(self, name, getattr(self, name)[mask])

    def forget(self, slot: int) -> None:
        """The unit in ``slot`` is gone."""
        if len(self):
            self.source[self.source == slot] = NOBODY
            self.target[self.target == slot] = NOBODY

    def content(self) -> bytes:
        """All rows as bytes, for the digest of the world."""
        return b"".join(np.ascontiguousarray(getattr(self, name)).tobytes() for name, _, _ in self.columns)


class Missiles(_Table):
    """Missiles in flight, (m,) each."""

    columns = (
        ("source", np.int64, 0),
        ("owner", np.int64, 0),
        ("target", np.int64, 0),
        ("weapon", np.int64, 0),
        ("hit", np.int64, 0),
        ("pos", np.float64, 2),
        ("goal", np.float64, 2),
        ("start", np.float64, 2),
        ("step", np.float64, 0),
        ("step_max", np.float64, 0),
        ("step_gain", np.float64, 0),
    )
    owner: Ints  # whose unit fired
    weapon: Ints  # row in catalog.weapons
    hit: Ints  # index in the weapon's hits
    pos: Floats  # (m, 2)
    goal: Floats  # (m, 2) where the target is, or was when it died
    start: Floats  # (m, 2) where it left
    step: Floats  # world units per loop, now
    step_max: Floats
    step_gain: Floats  # per loop; inf is at once


class PendingHits(_Table):
    """Hits that fall due at a later loop, (p,) each."""

    columns = (
        ("source", np.int64, 0),
        ("owner", np.int64, 0),
        ("target", np.int64, 0),
        ("weapon", np.int64, 0),
        ("hit", np.int64, 0),
        ("due", np.float64, 0),
        ("single", np.bool_, 0),
        ("goal", np.float64, 2),
        ("start", np.float64, 2),
    )
    owner: Ints
    weapon: Ints
    hit: Ints
    due: Floats  # loop, with its fraction
    single: NDArray[np.bool_]  # damage to the target alone, its splash or sweep is already resolved
    goal: Floats  # (p, 2) where the target is, or was when it died
    start: Floats  # (p, 2) where the attacker stood
