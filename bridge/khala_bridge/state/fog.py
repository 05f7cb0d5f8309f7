"""Creep as a player knows it: what is in sight as it is, the rest as it was when it was seen last.

The game sends the creep of the whole map, under the fog and where nobody ever was, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from khala_bridge.state.grid import Grid

SEEN_NOW = 2
"""The game's number for a cell that is in sight; 1 means seen before, 0 never seen."""


def known_creep(creep: Grid, visibility: Grid, before: Grid | None) -> Grid:
    """Return the creep that a player knows of.

    Args:
        creep: as the game sends it, of one bit.
        visibility: of the same size and moment; without it nothing is hidden.
        before: the result of the observation before; `NO_GRID` for none; None if nobody remembers, so that the creep
            counts as it is wherever the player has ever been.
    """
    if creep.bits != 1 or (not any(creep.data) and (before is None or not before.data)):
        return creep
    if (creep.width, creep.height) != (visibility.width, visibility.height) or visibility.bits != 8:
        return creep
    count = creep.width * creep.height
    sight = np.frombuffer(visibility.data, np.uint8)[:count]
    now = np.unpackbits(np.frombuffer(creep.data, np.uint8))[:count]
    if before is None:
        known = now * (sight > 0)
    else:
        then = np.unpackbits(np.frombuffer(before.data, np.uint8))[:count] if before.data else np.zeros_like(now)
        known = np.where(sight == SEEN_NOW, now, then)
    return creep._replace(data=np.packbits(known).tobytes())
