"""Tags: the API's numbers of units, which hold the slot; for compiled rules, see `World.slot_of` for others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.world.columns import INDEX_SHIFT, NOBODY, SLOT_BITS

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns


def slot_of(c: Columns, tag: int) -> int:
    """Return the slot of a living unit with this tag, or NOBODY."""
    slot = tag >> INDEX_SHIFT & SLOT_BITS
    return slot if tag != 0 and slot < c.capacity and c.tag[slot] == tag else NOBODY
