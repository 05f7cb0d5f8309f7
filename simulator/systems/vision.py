"""Vision: what each player sees, where the map has a fog of war.

A cell is visible when its centre is within the sight of a unit of the player's and not above the unit's own cliff
level, unless the unit flies. On maps whose script takes the fog away everybody sees everything.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from simulator import geometry
from simulator.mechanics import MECHANICS
from simulator.traits import Layer

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from simulator.world import World

SEEN_BEFORE = 1
VISIBLE = 2


def look(world: World) -> None:
    """Update ``visibility`` and ``visible``; where there is fog, every few loops."""
    n = world.top
    if world.fog and (world.loop % MECHANICS.vision_period == 0 or world.looked_at != world.population):
        for player in range(1, len(world.players)):
            _light(world, player)
    if world.fog or world.looked_at != world.population:
        for player in range(len(world.players)):
            world.visible[player, :n] = False
            world.visible[player, world.live] = _seen_units(world, player)
        world.looked_at = world.population


def _seen_units(world: World, player: int) -> NDArray[np.bool_]:
    hidden = (world.cloaked[world.live] | world.burrowed[world.live]) & (world.owner[world.live] != player)
    seen: NDArray[np.bool_] = world.is_visible(player) & ~hidden
    return seen


def _light(world: World, player: int) -> None:
    """Redraw one player's visibility grid."""
    grid = world.visibility[player]
    np.minimum(grid, SEEN_BEFORE, out=grid)
    height, width = grid.shape
    cliff = world.map.terrain.cliff
    for slot in world.units_of(player).tolist():
        cells = _disc(float(world.stats.sight[player, world.type[slot]])) + world.pos[slot].astype(np.int64)
        x, y = cells[:, 0], cells[:, 1]
        inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        x, y = x[inside], y[inside]
        if world.layer[slot] != Layer.AIR:
            eye = np.clip(world.pos[slot].astype(np.int64), 0, (width - 1, height - 1))
            level = int(cliff[eye[1], eye[0]]) + MECHANICS.high_ground_step
            low = cliff[y, x] < level
            x, y = x[low], y[low]
        grid[y, x] = VISIBLE


@lru_cache(maxsize=64)
def _disc(radius: float) -> NDArray[np.int64]:
    return geometry.disc_cells(radius)
