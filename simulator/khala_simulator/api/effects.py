"""What a player perceives in addition to units: effects on the ground, buffs, the power of pylons, radar.

The one place that decides which are visible; raw data, feature layers and rendered images show the same. Below:
`sight.py`, the world's area effects and buffs.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from khala_simulator.abilities.terran.buildings import RADAR, radars
from khala_simulator.api.sight import Alliance, Display, sees
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.world.active_buffs import FOREVER
from khala_simulator.world.players import NEUTRAL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.abilities.terran.buildings import Radar
    from khala_simulator.api.sight import Sight
    from khala_simulator.api.types import Types
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.world import World

    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]


BLIP_RADIUS = 0.5
"""World units of the disc that stands for a unit of which radar shows only the place."""


class Worn(NamedTuple):
    """Buffs on units of a sight, one row each, in the order in which they came."""

    row: Ints  # of the sight
    id: Ints  # of the API
    remain: Floats  # loops, 0 for one without an end
    total: Floats  # loops that it lasts, 0 for one without an end
    foreign: NDArray[np.bool_]  # cast by another player's unit


class Spots(NamedTuple):
    """Discs of the world."""

    pos: Floats  # [n, 2] world
    radius: Floats


class Power(NamedTuple):
    """Units of a sight that give power, and how far."""

    row: NDArray[np.intp]  # of the sight
    radius: Floats


def seen_area_effects(world: World, player: int, *, through_fog: bool = False) -> list[AreaEffect]:
    """Return the area effects with an API effect id that the player perceives: its own, and those in its sight."""
    told = [area for area in world.area_effects if area.effect]
    if through_fog or not told:
        return told
    return [f for f in told if f.owner == player or sees(world, player, np.array(f.points, float)).any()]


def seen_buffs(world: World, sight: Sight) -> Worn | None:
    """Return the buffs with an API id on units that are seen clearly, None if there are none."""
    if not len(world.buffs):
        return None
    rows = world.buffs.rows
    row_of = np.full(world.capacity, -1)
    clear = np.flatnonzero(sight.display == Display.VISIBLE.value)
    row_of[sight.slot[clear]] = clear
    ids = np.array([buff.id for buff in world.catalog.buffs])[rows["buff"]]
    told = np.flatnonzero((ids > 0) & (row_of[rows["slot"]] >= 0))
    rows, end = rows[told], rows["end"][told]
    ends = end < FOREVER
    remain, total = np.where(ends, end - world.loop, 0.0), np.where(ends, end - rows["begun"], 0.0)
    foreign = rows["owner"] != world.owner[rows["slot"]]
    return Worn(row_of[rows["slot"]], ids[told], np.maximum(remain, 0.0), total, foreign)


def power(sight: Sight, types: Types) -> Power | None:
    """Return which of the player's own finished units give power, None if none does."""
    reach = types.power[sight.row]
    if not reach.any():
        return None
    gives = (reach > 0) & (sight.alliance == Alliance.SELF.value) & (sight.build_progress >= 1) & ~sight.hallucination
    rows = np.flatnonzero(gives)
    return Power(rows, reach[rows])


def seen_radars(world: World, player: int) -> list[Radar]:
    """Return the radars that the player knows of: its own, and others' if it sees the tower."""
    types = world.type[: world.top]
    if not any(np.count_nonzero(types == row) for row in _towers(world.catalog.version)):
        return []
    known = [radar for radar in radars(world) if radar.owner == player]
    others = [radar for radar in radars(world) if radar.owner != player]
    if others:
        seen = sees(world, player, np.array([radar.point for radar in others])).tolist()
        known += [radar for radar, visible in zip(others, seen, strict=True) if visible]
    return known


def blips(world: World, types: Types, player: int) -> Floats:
    """Return [n, 2] where own radar detects others' units that the player does not see; structures do not move."""
    own = [radar for radar in seen_radars(world, player) if radar.owner == player]
    if not own:
        return np.zeros((0, 2))
    live = world.live
    foreign = (world.owner[live] != player) & (world.owner[live] != NEUTRAL) & ~types.structure[world.type[live]]
    pos = world.pos[live[foreign & ~world.is_visible(player)]]
    near = np.zeros(len(pos), np.bool_)
    for radar in own:
        near |= ((pos - radar.point) ** 2).sum(axis=1) <= radar.radius**2
    found: Floats = pos[near]
    return found


@functools.cache
def _towers(version: str) -> list[int]:
    catalog = load_catalog(version)
    return [catalog.row_of_name[name] for name in RADAR if name in catalog.row_of_name]
