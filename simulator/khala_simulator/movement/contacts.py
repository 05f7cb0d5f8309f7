"""Contacts: which bodies touch or nearly do.

A look-up for ``systems.collision``, which acts on it. Among a few bodies every pair is measured, with
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
TABLE_LIMIT: Final = 80  # up to so many units a table of all pairs is the faster way
WORTH_A_LOOK: Final = 40  # and up to so many bodies a look at one, as they seldom touch


@dataclass(slots=True)
class Pairs:
    """Pairs of bodies, as indices into the living slots, each pair both ways round."""

    both: Ints  # (2, k)
    apart: Floats  # (k,) distance to keep
    closest: float  # the least distance between two of a pair, squared

    @property
    def one(self) -> Ints:
        """(k,) the first of each pair."""
        one: Ints = self.both[0]
        return one

    @property
    def other(self) -> Ints:
        """(k,) the second."""
        other: Ints = self.both[1]
        return other


@dataclass(slots=True)
class Bodies:
    """The constants of the pairs of living bodies until a unit is born, dies or changes."""

    changes: int  # those of the world for which they hold
    content: tuple[bytes, ...]  # of the columns of which they are made
    count: int  # of living units
    rows: Ints  # (k,) those that can meet other bodies
    separation: Floats  # (n,) of every living unit
    bits: Ints  # (n,) layers it collides in, 0 for what stands on a footprint: that is a wall, not a body
    flying: Bools  # (n,)
    any_flying: bool
    widest: float  # the largest separation
    table: tuple[Floats, Floats, Floats] | None  # of all pairs of rows: touching, near, and to be kept; see ``_table``
    members: Ints  # (2, k * k) of each pair in it

    @classmethod
    def of(cls, world: World) -> Bodies:
        """Return the bodies of a world's living units."""
        slots = world.live
        bits = np.where(world.walled.take(slots), 0, world.layer_bits.take(slots))
        rows = which(bits != 0)
        separation = world.separation.take(slots)
        flying = world.layer.take(slots) == int(Layer.AIR)
        content = _content(world)
        sizes = separation.take(rows)
        table = _table(sizes, bits.take(rows)) if len(rows) <= TABLE_LIMIT else None
        members = np.stack((rows.repeat(len(rows)), np.tile(rows, len(rows)))) if len(slots) <= TABLE_LIMIT else rows
        widest = float(sizes.max(initial=0.0))
        any_flying = bool(flying.any())
        return cls(
            world.changes, content, len(slots), rows, separation, bits, flying, any_flying, widest, table, members
        )

    def near(self, at: Floats) -> Pairs | None:
        """Return the pairs that touch or nearly do when the bodies are at ``at`` (n, 2); None when no two touch.

        Forces are summed up in the order of the pairs, so it is always the same: by slots, or that of ``within``.
        """
        if len(self.rows) < self.count:
            at = at.take(self.rows, 0)
        if self.count <= TABLE_LIMIT:
            return self._looked_up(at)
        if len(self.rows) <= WORTH_A_LOOK and not self._touching(at)[1]:
            return None
        return self._neighbours(at)

    def _touching(self, at: Floats) -> tuple[Floats, bool]:
        """Return the distances of the pairs in the table, squared, and whether any two touch."""
        x, y = at[:, 0], at[:, 1]
        squared = x[:, None] - x
        squared *= squared
        dy = y[:, None] - y
        dy *= dy
        squared += dy
        return squared, self.table is not None and some(squared < self.table[0])

    def _looked_up(self, at: Floats) -> Pairs | None:
        squared, touch = self._touching(at)
        if not touch or self.table is None:
            return None
        flat = which((squared < self.table[1]).ravel())  # one index into a table costs a third of two
        return Pairs(self.members.take(flat, 1), self.table[2].take(flat), float(np.minimum.reduce(squared.take(flat))))

    def _neighbours(self, at: Floats) -> Pairs | None:
        """Do the same as ``_looked_up``, without a table."""
        if not len(at):
            return None
        pairs, squared = within(at, 2.0 * self.widest + SKIN)
        pairs = self.rows.take(pairs)
        apart = self.separation.take(pairs)
        apart = apart[0] + apart[1]
        bits = self.bits.take(pairs)
        meets = (bits[0] & bits[1]) != 0
        meets &= squared < (apart + SKIN) ** 2
        near = which(meets)
        squared, apart = squared.take(near), apart.take(near)
        if not some(squared < np.maximum(apart - OVERLAP_ALLOWED, 0.0) ** 2):
            return None
        one, other = pairs.take(near, 1)
        both = np.concatenate((one, other, other, one)).reshape(2, -1)
        return Pairs(both, np.concatenate((apart, apart)), float(np.minimum.reduce(squared)))


def bodies_of(world: World) -> Bodies:
    """Return the bodies of a world's living units, rebuilt now if something has changed."""
    known = world.bodies
    if isinstance(known, Bodies):
        if known.changes == world.changes:
            return known
        if known.content == _content(world):  # such as when a worker took up a load
            known.changes = world.changes
            return known
    made = world.bodies = Bodies.of(world)
    return made


def _content(world: World) -> tuple[bytes, ...]:
    """Return all of which ``Bodies`` are made."""
    columns = (world.walled, world.layer_bits, world.layer, world.separation)
    return world.live.tobytes(), *(column.take(world.live).tobytes() for column in columns)


def within(at: Floats, reach: float) -> tuple[Ints, Floats]:
    """Return (2, k) every pair of points (n, 2) less than ``reach`` apart on both axes, and (k,) its distance squared.

    Each pair is there once. The points are sorted along the axis on which they spread wider, and each is paired with
    those that follow.
    """
    axes = np.ascontiguousarray(at.T)
    spread = np.maximum.reduce(axes, axis=1) - np.minimum.reduce(axes, axis=1)
    along, across = axes if spread[0] >= spread[1] else axes[::-1]
    order = along.argsort(kind="stable")
    along, across = along.take(order), across.take(order)
    rank = np.arange(len(order))
    follow = along.searchsorted(along + reach)
    follow -= rank
    follow -= 1
    one = rank.repeat(follow)
    # the first of the k-th point's pairs is the sum of all before, its followers begin at k + 1
    other = np.arange(len(one))
    other += (rank + 1 + follow - np.add.accumulate(follow)).repeat(follow)
    aside = across.take(one) - across.take(other)
    close = which(np.abs(aside) < reach)
    one, other, aside = one.take(close), other.take(close), aside.take(close)
    ahead = along.take(one) - along.take(other)
    ahead *= ahead
    aside *= aside
    ahead += aside
    return order.take(np.concatenate((one, other)).reshape(2, -1)), ahead


def _table(separation: Floats, bits: Ints) -> tuple[Floats, Floats, Floats]:
    """Return for every pair: touching and near distance, squared, -1 if they never meet; and the distance to keep."""
    apart = separation[:, None] + separation
    meets = (bits[:, None] & bits) != 0
    np.fill_diagonal(meets, val=False)
    touching = np.where(meets, np.maximum(apart - OVERLAP_ALLOWED, 0.0) ** 2, -1.0)
    return touching, np.where(meets, (apart + SKIN) ** 2, -1.0), apart
