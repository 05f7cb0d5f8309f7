"""Contacts: which bodies touch or nearly do.

A look-up for ``movement.pushing``, which acts on it.

Which pairs: two bodies that share a layer and whose distance is less than the one that they keep plus a ``SKIN``,
because a body that is pushed off one neighbour may come upon the next. There is nothing to do unless two of a pair
overlap by more than ``OVERLAP_ALLOWED``. A structure on its footprint is a wall and no body.

The steps of one look, and why they come in this order:

1. List the bodies, in the order of their slots.
2. If they are more than ``FEW``, rank them along the axis on which they spread wider: recall the order of the last
   look, of which little has changed, then sort by insertion, which costs little where little is out of place.
3. Copy what is measured side by side, in that order, so that the inner loop reads memory in a line.
4. Measure each body with those that follow it: with all among few; among many with those within the reach of the two
   widest, so that the cost grows with the crowd and not with its square. This filter has no branch; the second pass
   over the few that are left looks at layers and notes the pairs.

In which order: sums of pushes are rounded, so their order decides the last bit of a position, and it must follow from
the state of the world alone. The bodies stand in the order of their slots among few, and along the axis among many,
where equal ones follow their slots. Each forms its pairs with those that follow it, in that order. Of the pushes that a
body gets, those as the second of a pair are summed up first among few, those as the first of it among many.

To be kept in step by hand: the recalled order may save time but never decide: the sort has one result, whatever it
begins with. ``pushing`` follows ``by_slots`` in the order of its sums. ``_place`` is -1 everywhere between two looks.
A new column of pairs that a look itself writes belongs to the first three of ``arrays`` in ``_reserve_pairs``: they
survive when the room grows in the middle of the look.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala_simulator.native import memory

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.world.world import World

SKIN: Final = 0.1
OVERLAP_ALLOWED: Final = 0.005
FEW: Final = 80
FAR: Final = 1e300


class Crowd:
    """The bodies of one world, and room for what is measured between them; ``count`` of them are alive.

    Attributes:
        before: (count,) where each stood.
        after: (count,) where it goes.
        start: (count,) from where it is pushed.
        force: (count,) how far all its pairs push it.
        enemy: (count,) how easily an enemy pushes it.
        friend: (count,) how easily a friend does.
        pairs: How many are near each other.
        first: (pairs,) indices into the living slots.
        second: (pairs,) the same.
        apart: (pairs,) distance to keep.
        share: (pairs,) part of an overlap by which the first gives way.
        rest: (pairs,) that of the second.
        offset: (pairs,) from the second to the first.
        distance: (pairs,) its length.
        push: (pairs,) part of the offset that makes up for an overlap.
        chosen: (pairs,) room for numbers of pairs.
        closest: The least distance between the two of a pair, squared.
        by_slots: Whether the bodies are few, in the order of their slots.
    """

    def __init__(self) -> None:
        self.count = 0
        self.pairs = 0
        self.closest = FAR
        self.by_slots = True
        self._body_room = 0
        self._pair_room = 0
        self._slot_room = 0
        self._last = 0  # how many bodies were ranked last
        self._pair_arrays: tuple[Any, ...] = ()

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Return what makes None: a copy of a world makes its own room."""
        return type(None), ()

    def reserve(self, count: int, slots: int) -> None:
        """Make room for so many bodies in so many slots."""
        self.count = count
        if count > self._body_room:
            self._reserve_bodies(2 * count)
        if slots > self._slot_room:
            self._slot_room = slots
            self._place_array = np.full(slots, -1, dtype=np.int64)
            self._place = memory.ints(self._place_array)

    def _reserve_bodies(self, room: int) -> None:
        """Make room for so many bodies; nothing of the old is kept."""
        points = [memory.new_points(room) for _ in range(5)]
        floats = [memory.new_floats(room) for _ in range(4)]
        ints = [memory.new_ints(room) for _ in range(4)]
        self._body_arrays = points, floats, ints
        self.before = memory.points(points[0])
        self.after = memory.points(points[1])
        self.start = memory.points(points[2])
        self.force = memory.points(points[3])
        self._at = memory.points(points[4])
        self.enemy = memory.floats(floats[0])
        self.friend = memory.floats(floats[1])
        self._along = memory.floats(floats[2])
        self._separation = memory.floats(floats[3])
        self._body = memory.ints(ints[0])
        self._layers = memory.ints(ints[1])
        self._close = memory.ints(ints[2])
        self._ranked = memory.ints(ints[3])
        self._body_room = room
        self._last = 0

    def _reserve_pairs(self, room: int) -> None:
        """Make room for so many pairs; those that are found already are kept."""
        ints = [memory.new_ints(room) for _ in range(3)]
        floats = [memory.new_floats(room) for _ in range(5)]
        offset = memory.new_points(room)
        arrays = (ints[0], ints[1], floats[0], *ints[2:], *floats[1:], offset)
        for new, old in zip(arrays[:3], self._pair_arrays, strict=False):
            new[: self.pairs] = old[: self.pairs]
        self._pair_arrays = arrays
        self.first = memory.ints(ints[0])
        self.second = memory.ints(ints[1])
        self.chosen = memory.ints(ints[2])
        self.apart = memory.floats(floats[0])
        self.share = memory.floats(floats[1])
        self.rest = memory.floats(floats[2])
        self.distance = memory.floats(floats[3])
        self.push = memory.floats(floats[4])
        self.offset = memory.points(offset)
        self._pair_room = room

    def find_pairs(self, c: Columns, slots: Cells) -> bool:
        """Find the pairs that touch or nearly do, in their order; return whether any two touch."""
        self.pairs = 0
        self.closest = FAR
        self.by_slots = self.count <= FEW
        bodies = 0
        for i in range(self.count):
            if c.layer_bits[slots[i]] != 0 and not c.walled[slots[i]]:
                self._body[bodies] = i
                bodies += 1
        if not self.by_slots:
            self._rank(slots, bodies)
        widest = 0.0
        for k in range(bodies):
            i = self._body[k]
            self._at[k] = self.after[i]
            self._separation[k] = c.separation[slots[i]]
            self._layers[k] = c.layer_bits[slots[i]]
            widest = max(widest, self._separation[k])
        reach = 2.0 * widest + SKIN
        touch = False
        end = bodies if self.by_slots else 0
        for k in range(bodies):
            while end < bodies and self._along[end] < self._along[k] + reach:
                end += 1
            touch |= self._meet(k, end)
        return touch

    def _rank(self, slots: Cells, bodies: int) -> None:
        """Sort the bodies along the axis on which they spread wider."""
        self._recall(slots, bodies)
        body = self._body
        along = self._along
        across = self._spreads_upwards(bodies)
        for k in range(bodies):
            along[k] = self.after[body[k]].y if across else self.after[body[k]].x
        for k in range(1, bodies):
            i = body[k]
            value = along[k]
            j = k
            while j > 0 and (along[j - 1] > value or (along[j - 1] == value and body[j - 1] > i)):
                along[j] = along[j - 1]
                body[j] = body[j - 1]
                j -= 1
            along[j] = value
            body[j] = i
        for k in range(bodies):
            self._ranked[k] = slots[body[k]]
        self._last = bodies

    def _recall(self, slots: Cells, bodies: int) -> None:
        """Put the bodies in the order of the last loop, and new ones at the end."""
        body = self._body
        place = self._place  # (slots,) of each that is not in order yet its index, else -1
        for k in range(bodies):
            place[slots[body[k]]] = body[k]
        known = 0
        for k in range(self._last):
            slot = self._ranked[k]
            if place[slot] >= 0:
                body[known] = place[slot]
                place[slot] = -1
                known += 1
        for i in range(self.count):
            slot = slots[i]
            if place[slot] >= 0:
                body[known] = i
                place[slot] = -1
                known += 1

    def _spreads_upwards(self, bodies: int) -> bool:
        """Return whether the bodies spread wider on the y axis."""
        if not bodies:
            return False
        at = self.after[self._body[0]]
        low_x = high_x = at.x
        low_y = high_y = at.y
        for k in range(1, bodies):
            at = self.after[self._body[k]]
            low_x = min(low_x, at.x)
            high_x = max(high_x, at.x)
            low_y = min(low_y, at.y)
            high_y = max(high_y, at.y)
        return high_x - low_x < high_y - low_y

    def _meet(self, k: int, end: int) -> bool:
        """Note the pairs of the k-th body with those that follow, up to ``end``; return whether any two touch."""
        at = self._at
        separation = self._separation
        close = self._close
        here = at[k]
        size = separation[k]
        near = 0
        for j in range(k + 1, end):  # without a branch, as none could be foreseen
            there = at[j]
            x = here.x - there.x
            y = here.y - there.y
            beside = size + separation[j] + SKIN
            close[near] = j
            near += x * x + y * y < beside * beside
        if self.pairs + near > self._pair_room:
            self._reserve_pairs(2 * (self.pairs + near) + 64)
        touch = False
        for n in range(near):
            j = close[n]
            if self._layers[k] & self._layers[j] == 0:
                continue
            x = here.x - at[j].x
            y = here.y - at[j].y
            squared = x * x + y * y
            apart = size + separation[j]
            inside = max(apart - OVERLAP_ALLOWED, 0.0)
            self.first[self.pairs] = self._body[k]
            self.second[self.pairs] = self._body[j]
            self.apart[self.pairs] = apart
            self.pairs += 1
            self.closest = min(self.closest, squared)
            touch |= squared < inside * inside
        return touch


def crowd_of(world: World) -> Crowd:
    """Return the crowd of a world."""
    if world.bodies is None:
        world.bodies = Crowd()
    crowd: Crowd = world.bodies  # type: ignore[assignment]  # its fields say less
    return crowd
