"""Vision: what each player sees, where the map has a fog of war.

A cell is visible when its centre is within the sight of a unit of the player's and not above the unit's own cliff
level, unless the unit flies. On maps whose script takes the fog away everybody sees everything. Units that are cloaked
or burrowed are seen where a detector of the player's, a scan, or a buff that reveals them looks.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from simulator import geometry
from simulator.mechanics import MECHANICS
from simulator.snapshots import remember
from simulator.traits import Layer

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from simulator.catalog import Catalog
    from simulator.world import World

SEEN_BEFORE = 1
VISIBLE = 2


def look(world: World) -> None:
    """Update ``visibility`` and ``visible``; where there is fog or somebody hides, every few loops."""
    n = world.top
    changed = world.looked_at != world.population
    due = world.loop % MECHANICS.vision_period == 0 or changed
    if world.fog and due:
        for player in range(1, len(world.players)):
            _light(world, player)
    if world.fog or changed or (world.hiding and due):
        for player in range(len(world.players)):
            world.visible[player, :n] = False
            world.visible[player, world.live] = _seen_units(world, player)
        _reveal(world)
        if world.fog and due:
            for player in range(1, len(world.players)):
                remember(world, player)
        world.looked_at = world.population


def _seen_units(world: World, player: int) -> NDArray[np.bool_]:
    seen: NDArray[np.bool_] = world.is_visible(player)
    if not world.hiding:
        return seen
    slots = world.live
    own = world.owner[slots] == player
    hidden = world.cloaked[slots] & ~own  # whatever burrows is cloaked until something uncovers it
    if hidden.any():
        found = np.flatnonzero(hidden)
        hidden[found[detected(world, player, slots[found])]] = False
    seen &= ~hidden
    return seen


def detected(world: World, player: int, slots: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(k,) whether a detector or a scan of the player's reaches each unit's edge."""
    eyes = world.units_of(player)
    eyes = eyes[world.detects[eyes] > 0.0]
    scans = [item for item in world.fields if item.detects and item.owner == player]
    at = np.concatenate((world.pos[eyes], np.array([item.at for item in scans]).reshape(-1, 2)))
    reach = np.concatenate((world.detects[eyes], np.array([item.radius for item in scans])))
    offset = world.pos[slots][:, None, :] - at
    near = offset[..., 0] ** 2 + offset[..., 1] ** 2 <= (reach + world.radius[slots, None]) ** 2
    found: NDArray[np.bool_] = near.any(axis=1)
    return found


def _reveal(world: World) -> None:
    """Show units under a revealing buff to whoever laid it on them."""
    for row in world.buffs.rows:
        if "revealed" in world.catalog.buffs[int(row["buff"])].flags:
            world.visible[int(row["owner"]), int(row["slot"])] = True


def _light(world: World, player: int) -> None:
    """Redraw one player's visibility grid."""
    grid = world.visibility[player]
    np.minimum(grid, SEEN_BEFORE, out=grid)
    height, width = grid.shape
    cliff = world.map.terrain.cliff
    for point, radius in _lights(world, player):
        cells = _disc(radius) + np.array(point).astype(np.int64)
        x, y = cells[:, 0], cells[:, 1]
        inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        grid[y[inside], x[inside]] = VISIBLE
    for slot in world.units_of(player).tolist():
        cells = _disc(float(world.sight[slot])) + world.pos[slot].astype(np.int64)
        x, y = cells[:, 0], cells[:, 1]
        inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        x, y = x[inside], y[inside]
        if world.layer[slot] != Layer.AIR:
            eye = np.clip(world.pos[slot].astype(np.int64), 0, (width - 1, height - 1))
            level = int(cliff[eye[1], eye[0]]) + MECHANICS.high_ground_step
            low = cliff[y, x] < level
            x, y = x[low], y[low]
        grid[y, x] = VISIBLE


def _lights(world: World, player: int) -> list[tuple[tuple[float, float], float]]:
    """Places that a player sees without a unit there, with the radius: by his fields, and by his buffs on others."""
    lights = [(item.at, item.sights) for item in world.fields if item.sights and item.owner == player]
    rows = world.buffs.rows
    for row in rows[np.isin(rows["buff"], _lighting(world.catalog)) & (rows["owner"] == player)] if len(rows) else ():
        x, y = world.pos[int(row["slot"])].tolist()
        lights.append(((x, y), world.catalog.buffs[int(row["buff"])].lights))
    return lights


@lru_cache(maxsize=4)
def _lighting(catalog: Catalog) -> NDArray[np.int64]:
    """Rows of the kinds of buffs that light the ground around their bearers."""
    return np.array([kind.row for kind in catalog.buffs if kind.lights], dtype=np.int64)


@lru_cache(maxsize=64)
def _disc(radius: float) -> NDArray[np.int64]:
    return geometry.disc_cells(radius)
