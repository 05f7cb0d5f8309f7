"""Contacts: which bodies touch or nearly do.

A look-up for ``systems.collision`` and ``avoidance``, which act on it. Among a few bodies every pair is measured, with
distances looked up in a table; many are sorted along the wider axis of the crowd and only neighbours are measured, so
that the cost grows with the crowd and not with its square.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.numeric.arrays import some, which
from khala_simulator.tables.layers import Layer

if TYPE_CHECKING:
    from khala_simulator.world.columns import Bools, Floats, Ints
    from khala_simulator.world.world import World

SKIN: Final = 0.1  # how far apart two bodies may be to be worth looking at
OVERLAP_ALLOWED: Final = 0.005
TABLE_LIMIT: Final = 80  # up to so many bodies a table of all pairs is the faster way


@dataclass(slots=True)
class Pairs:
    """Pairs of bodies (k,), as indices into the living slots, each pair both ways round; ``apart`` is what to keep."""

    one: Ints
    other: Ints
    apart: Floats


@dataclass(slots=True)
class Bodies:
    """The constants of the pairs of living bodies until a unit is born, dies or changes."""

    rows: Ints  # (k,) those that can meet other bodies
    separation: Floats  # (n,) of every living unit
    bits: Ints  # (n,) layers it collides in, 0 for what stands on a footprint: that is a wall, not a body
    flying: Bools  # (n,)
    any_flying: bool
    widest: float  # the largest separation
    table: tuple[Floats, Floats, Floats] | None  # of all pairs: touching and near, squared, and to be kept

    @classmethod
    def of(cls, world: World) -> Bodies:
        """Return the bodies of a world's living units."""
        slots = world.live
        bits = np.where(world.walled[slots], 0, world.layer_bits[slots])
        rows = which(bits != 0)
        separation = world.separation[slots]
        flying = world.layer[slots] == int(Layer.AIR)
        table = _table(separation, bits) if len(slots) <= TABLE_LIMIT else None
        widest = float(separation[rows].max(initial=0.0))
        return cls(rows, separation, bits, flying, bool(flying.any()), widest, table)

    def near(self, at: Floats) -> Pairs | None:
        """Return the pairs that touch or nearly do when the bodies are at ``at`` (n, 2); None when no two touch."""
        if self.table is None:
            return self._neighbours(at)
        touching, near, apart = self.table
        x, y = at[:, 0], at[:, 1]
        squared = x[:, None] - x
        squared *= squared
        dy = y[:, None] - y
        dy *= dy
        squared += dy
        if not some(squared < touching):
            return None
        flat = which((squared < near).ravel())  # one index into a table costs a third of two
        one, other = np.divmod(flat, len(at))
        return Pairs(one, other, apart.take(flat))

    def _neighbours(self, at: Floats) -> Pairs | None:
        """Do the same as ``near``, without a table."""
        if not len(self.rows):
            return None
        one, other, squared = within(at.take(self.rows, 0), 2.0 * self.widest + SKIN)
        one, other = self.rows.take(one), self.rows.take(other)
        apart = self.separation.take(one) + self.separation.take(other)
        meets = (self.bits.take(one) & self.bits.take(other)) != 0
        meets &= squared < (apart + SKIN) ** 2
        squared, apart = squared[meets], apart[meets]
        if not some(squared < np.maximum(apart - OVERLAP_ALLOWED, 0.0) ** 2):
            return None
        one, other = one[meets], other[meets]
        return Pairs(np.concatenate((one, other)), np.concatenate((other, one)), np.concatenate((apart, apart)))


def bodies_of(world: World) -> Bodies:
    """Return the bodies of a world's living units, rebuilt now if something has changed."""
    known = world.bodies
    if not isinstance(known, Bodies):
        known = world.bodies = Bodies.of(world)
    return known


def within(at: Floats, reach: float) -> tuple[Ints, Ints, Floats]:
    """Return every pair of points (n, 2) less than ``reach`` apart on both axes, once, and their distance squared.

    The points are sorted along the axis on which they spread wider, and each is paired with those that follow.
    """
    axes = np.ascontiguousarray(at.T)
    along, across = axes if np.ptp(axes[0]) >= np.ptp(axes[1]) else axes[::-1]
    order = np.argsort(along, kind="stable")
    along, across = along.take(order), across.take(order)
    rank = np.arange(len(order))
    follow = np.searchsorted(along, along + reach, "left") - rank - 1
    one = np.repeat(rank, follow)
    first = np.cumsum(follow) - follow
    other = np.arange(len(one)) - np.repeat(first - rank - 1, follow)
    aside = across.take(one) - across.take(other)
    close = which(np.abs(aside) < reach)
    one, other, aside = one.take(close), other.take(close), aside.take(close)
    ahead = along.take(one) - along.take(other)
    return order.take(one), order.take(other), ahead * ahead + aside * aside


def _table(separation: Floats, bits: Ints) -> tuple[Floats, Floats, Floats]:
    """Return for every pair: touching and near distance, squared, -1 if they never meet; and the distance to keep."""
    apart = separation[:, None] + separation
    meets = (bits[:, None] & bits) != 0
    np.fill_diagonal(meets, val=False)
    touching = np.where(meets, np.maximum(apart - OVERLAP_ALLOWED, 0.0) ** 2, -1.0)
    return touching, np.where(meets, (apart + SKIN) ** 2, -1.0), apart
