"""Vision: what each player sees, where the map has a fog of war.

A cell is visible when its centre is within the sight of a unit of the player's and not above the unit's own cliff
level, unless the unit flies. On maps whose script removes the fog every player sees everything. Units that are cloaked
or burrowed are seen where a detector of the player, a scan, or a revealing buff covers them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.combat.fog import remember
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import which
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from khala_simulator.maps.game_map import Terrain
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Bools, Floats
    from khala_simulator.world.world import World

Eye = tuple[int, int, int, float, int]
"""What sees: for which player, its cell, its radius, and the cliff level from which on it does not see."""

AIR = Layer.AIR.value
SEEN_BEFORE = 1
VISIBLE = 2
FROM_ABOVE = 1 << 20  # higher than any cliff: nothing hides from it


def look(world: World) -> None:
    """Update ``visibility`` and ``visible``; where there is fog or a unit hides, every few loops."""
    changed = world.looked_at != world.population
    due = world.loop % MECHANICS.vision_period == 0 or changed
    if world.fog and due:
        _light(world)
    if world.fog or changed or (world.hiding and due):
        world.visible[:, : world.top] = False
        world.visible[:, world.live] = _seen_units(world)
        reveal(world)
        if world.fog and due:
            for player in range(1, len(world.players)):
                remember(world, player)
        world.looked_at = world.population


def _seen_units(world: World) -> Bools:
    """Return (players, len(world.live)) whether each player sees each living unit."""
    seen = world.visible_units()
    if world.hiding:
        slots = world.live
        cloaked = which(world.cloaked.take(slots))  # whatever burrows is cloaked until something uncovers it
        hidden, owner = slots.take(cloaked), world.owner.take(slots.take(cloaked))
        for player in range(len(world.players) if hidden.size else 0):
            seen[player, cloaked] &= (owner == player) | detected(world, player, hidden)
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


def reveal(world: World) -> None:
    """Show units under a revealing buff to the player that applied it."""
    for row in _buffs(world, _revealing(world.catalog)):
        world.visible[int(row["owner"]), int(row["slot"])] = True


# light ----------------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Eyes:
    """What the players saw with last, and how many eyes see each cell now."""

    units: Floats  # (5, slots) owner (0: sees for nobody), cell x and y, radius, and the cliff level that it can't see
    lights: set[Eye]  # those that are no units
    count: NDArray[np.int16]  # (players, h, w)


def _light(world: World) -> None:
    """Redraw every player's visibility grid."""
    eyes = world.eyes
    if not isinstance(eyes, Eyes):
        eyes = world.eyes = Eyes(np.zeros((5, 0)), set(), np.zeros(world.visibility.shape, dtype=np.int16))
    _recount(world, eyes)
    grids = world.visibility[1:]
    np.minimum(grids, SEEN_BEFORE, out=grids)
    np.copyto(grids, VISIBLE, where=eyes.count[1:] > 0)
    for player in world.players[1:]:
        if "show_map" in player.cheats:
            world.visibility[player.id] = VISIBLE


def _recount(world: World, eyes: Eyes) -> None:
    """Count what each eye sees; only those that differ from the last time.

    Most units stand or stay in their cell: with 130 units a side, 10 eyes of 100 change in a look.
    """
    before, now, terrain = eyes.units, _unit_eyes(world), world.map.terrain
    if before.shape != now.shape:
        before = np.pad(before, ((0, 0), (0, now.shape[1] - before.shape[1])))
    changed = which(np.logical_or.reduce(before != now))
    for sign, of in ((-1, before), (1, now)):
        for owner, x, y, radius, below in of.take(changed, 1).T.tolist():
            _count(eyes.count, terrain, (int(owner), int(x), int(y), radius, int(below)), sign)
    eyes.units = now
    count_lights(world, eyes)


def count_lights(world: World, eyes: Eyes) -> None:
    """Count what the eyes see that are no units; only those that come or go."""
    lights = set(_lights(world))
    for light in lights - eyes.lights:
        _count(eyes.count, world.map.terrain, light, 1)
    for light in eyes.lights - lights:
        _count(eyes.count, world.map.terrain, light, -1)
    eyes.lights = lights


def _unit_eyes(world: World) -> Floats:
    """Return (5, slots) the eyes of all units, as in ``Eyes``."""
    n, cliff = world.top, world.map.terrain.cliff
    height, width = cliff.shape
    cells = world.pos[:n].astype(np.int64)
    inside = np.minimum(np.maximum(cells, 0), (width - 1, height - 1))
    eyes = np.zeros((5, n))
    eyes[0, world.live] = world.owner.take(world.live)
    eyes[1:3] = cells.T
    eyes[3] = world.sight[:n]
    eyes[4] = cliff.take(inside[:, 1] * width + inside[:, 0])
    eyes[4] += MECHANICS.high_ground_step
    eyes[4, world.layer[:n] == AIR] = FROM_ABOVE
    return eyes


def _count(count: NDArray[np.int16], terrain: Terrain, eye: Eye, sign: int) -> None:
    """Add every cell that an eye sees, or take it away."""
    if eye[0]:
        box, shape = _view(terrain, *eye[1:])
        cells = count[eye[0]][box]
        (np.add if sign > 0 else np.subtract)(cells, shape, out=cells)


@lru_cache(maxsize=1 << 14)
def _view(terrain: Terrain, x: int, y: int, radius: float, below: int) -> tuple[tuple[slice, slice], Bools]:
    """Return what is seen from a cell: a box of the map, and which of its cells.

    Workers come to the same cells again and again.
    """
    width, height = terrain.size
    mask, half = disc(radius)
    left, low = max(x - half, 0), max(y - half, 0)
    right, high = max(min(x + half + 1, width), left), max(min(y + half + 1, height), low)
    shape = mask[low - y + half : high - y + half, left - x + half : right - x + half]
    box = slice(low, high), slice(left, right)
    return box, shape if below == FROM_ABOVE else shape & (terrain.cliff[box] < below)


def _lights(world: World) -> Iterator[Eye]:
    """Yield what players see without a unit there: by area effects and buffs on others."""
    for item in world.area_effects:
        if item.sights:
            x, y = item.at
            yield item.owner, int(x), int(y), item.sights, FROM_ABOVE
    for row in _buffs(world, _lighting(world.catalog)):
        x, y = world.pos[int(row["slot"])].tolist()
        yield int(row["owner"]), int(x), int(y), world.catalog.buffs[int(row["buff"])].lights, FROM_ABOVE


def _buffs(world: World, kinds: Bools) -> NDArray[np.void]:
    """Return the buffs of some kinds."""
    rows = world.buffs.rows
    found: NDArray[np.void] = rows[kinds.take(rows["buff"])]
    return found


@lru_cache(maxsize=4)
def _revealing(catalog: Catalog) -> Bools:
    """Return whether each kind of buff reveals its bearer."""
    return np.array(["revealed" in kind.flags for kind in catalog.buffs])


@lru_cache(maxsize=4)
def _lighting(catalog: Catalog) -> Bools:
    """Return whether each kind of buff lights the ground around its bearer."""
    return np.array([bool(kind.lights) for kind in catalog.buffs])


@lru_cache(maxsize=64)
def disc(radius: float) -> tuple[NDArray[np.bool_], int]:
    """Return the cells within a radius as a square mask, and how far its middle is from its edge."""
    cells = geometry.disc_cells(radius)
    half = int(np.abs(cells).max(initial=0))
    mask = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.bool_)
    mask[cells[:, 1] + half, cells[:, 0] + half] = True
    return mask, half
