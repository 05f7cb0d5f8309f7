"""Vision: what each player sees, where the map has a fog of war.

A cell is visible when its centre is within the sight of a unit of the player's and not above the unit's own cliff
level, unless the unit flies. On maps whose script removes the fog every player sees everything. Units that are cloaked
or burrowed are seen where a detector of the player, a scan, or a revealing buff covers them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.combat.fog import remember
from khala_simulator.numeric import geometry
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.caches import Eye
    from khala_simulator.world.world import World

SEEN_BEFORE = 1
VISIBLE = 2
FROM_ABOVE = 1 << 20  # higher than any cliff: nothing hides from it


def look(world: World) -> None:
    """Update ``visibility`` and ``visible``; where there is fog or a unit hides, every few loops."""
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
    """Return (k,) whether a detector or a scan of the player reaches each unit's edge."""
    eyes = world.units_of(player)
    eyes = eyes[world.detects[eyes] > 0.0]
    scans = [item for item in world.area_effects if item.detects and item.owner == player]
    at = np.concatenate((world.pos[eyes], np.array([item.at for item in scans]).reshape(-1, 2)))
    reach = np.concatenate((world.detects[eyes], np.array([item.radius for item in scans])))
    offset = world.pos[slots][:, None, :] - at
    near = offset[..., 0] ** 2 + offset[..., 1] ** 2 <= (reach + world.radius[slots, None]) ** 2
    found: NDArray[np.bool_] = near.any(axis=1)
    return found


def _reveal(world: World) -> None:
    """Show units under a revealing buff to the player that applied it."""
    for row in world.buffs.rows:
        if "revealed" in world.catalog.buffs[int(row["buff"])].flags:
            world.visible[int(row["owner"]), int(row["slot"])] = True


def _light(world: World, player: int) -> None:
    """Redraw one player's visibility grid."""
    grid, cliff = world.visibility[player], world.map.terrain.cliff
    if "show_map" in world.players[player].cheats:
        grid[:] = VISIBLE
        return
    np.minimum(grid, SEEN_BEFORE, out=grid)
    height, width = grid.shape
    eyes = {(int(x), int(y), radius, FROM_ABOVE) for (x, y), radius in _lights(world, player)}
    slots = world.units_of(player)
    cells = world.pos[slots].astype(np.int64)
    inside = np.clip(cells, 0, (width - 1, height - 1))
    level = cliff[inside[:, 1], inside[:, 0]].astype(np.int64) + MECHANICS.high_ground_step
    level[world.layer[slots] == Layer.AIR.value] = FROM_ABOVE
    eyes.update(zip(*cells.T.tolist(), world.sight[slots].tolist(), level.tolist(), strict=True))
    np.copyto(grid, VISIBLE, where=_seen_by(world, player, eyes) > 0)


def _seen_by(world: World, player: int, eyes: set[Eye]) -> NDArray[np.int16]:
    """Return (h, w) how many of the eyes see each cell; only those that differ from the last time are counted.

    Most units stand or stay in their cell: with 130 units a side, 10 eyes of 100 change in a look.
    """
    before, count = world.eyes.get(player) or (set(), np.zeros(world.map.terrain.cliff.shape, dtype=np.int16))
    for eye in eyes - before:
        _count(count, world.map.terrain.cliff, eye, 1)
    for eye in before - eyes:
        _count(count, world.map.terrain.cliff, eye, -1)
    world.eyes[player] = eyes, count
    return count


def _count(count: NDArray[np.int16], cliff: NDArray[np.uint16], eye: Eye, by: int) -> None:
    """Add a number to every cell that an eye sees; units in the same cell are one eye."""
    (x, y, radius, below), (height, width) = eye, count.shape
    mask, half = _disc(radius)
    left, low = max(x - half, 0), max(y - half, 0)
    right, high = max(min(x + half + 1, width), left), max(min(y + half + 1, height), low)
    shape = mask[low - y + half : high - y + half, left - x + half : right - x + half]
    if below != FROM_ABOVE:
        shape = shape & (cliff[low:high, left:right] < below)
    count[low:high, left:right] += shape * np.int16(by)


def _lights(world: World, player: int) -> list[tuple[tuple[float, float], float]]:
    """Return places that a player sees without a unit there, with the radius: by area effects and buffs on others."""
    lights = [(item.at, item.sights) for item in world.area_effects if item.sights and item.owner == player]
    rows = world.buffs.rows
    for row in rows[np.isin(rows["buff"], _lighting(world.catalog)) & (rows["owner"] == player)] if len(rows) else ():
        x, y = world.pos[int(row["slot"])].tolist()
        lights.append(((x, y), world.catalog.buffs[int(row["buff"])].lights))
    return lights


@lru_cache(maxsize=4)
def _lighting(catalog: Catalog) -> NDArray[np.int64]:
    """Return the rows of the kinds of buffs that light the ground around their bearers."""
    return np.array([kind.row for kind in catalog.buffs if kind.lights], dtype=np.int64)


@lru_cache(maxsize=64)
def _disc(radius: float) -> tuple[NDArray[np.bool_], int]:
    """Return the cells within a radius as a square mask, and how far its middle is from its edge."""
    cells = geometry.disc_cells(radius)
    half = int(np.abs(cells).max(initial=0))
    mask = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.bool_)
    mask[cells[:, 1] + half, cells[:, 0] + half] = True
    return mask, half
