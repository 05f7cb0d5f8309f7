"""What a player sees of the shooting: recent attacks between units, and missiles in the air.

The API does not report it; rendered images show it, as the game's own picture does. Above: `painting`. Below:
`sight.py`, which says which units are visible.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from khala_simulator.api.sight import API_NEUTRAL, Display, alliance_of, sees
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.players import NEUTRAL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.api.sight import Sight
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.world import World

    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]

FLASH_LOOPS = 5.0
"""Loops for which an attack is shown after its damage point."""


class Strikes(NamedTuple):
    """Attacks that have just taken effect, by rows of the sight."""

    attacker: Ints
    target: Ints
    melee: NDArray[np.bool_]


class InFlight(NamedTuple):
    """Missiles under way."""

    pos: Floats  # [m, 2] world
    goal: Floats  # [m, 2]
    owner: Ints  # 16 is neutral
    alliance: Ints


def strikes(world: World, sight: Sight) -> Strikes:
    """Return the attacks of the last loops between units that are both visible.

    The weapon's cooldown, which runs from the attack's start, shows when an attack took effect; the random delay of up
    to two loops in it is not known here.
    """
    clear = sight.display == Display.VISIBLE.value
    row_of = np.full(world.capacity, NOBODY)
    row_of[sight.slot[clear]] = np.flatnonzero(clear)
    slot = sight.slot
    weapon, target, cooldown = world.weapon[slot], world.target[slot], world.cooldown[slot]
    fires = clear & (weapon >= 0) & (target != NOBODY) & (cooldown > 0) & (world.windup[slot] < 0)
    attacker = np.flatnonzero(fires)
    weapon, at = weapon[attacker], row_of[target[attacker]]
    damage_point, melee = _rhythm(world.catalog)
    period = world.stats.period[world.owner[slot[attacker]], weapon]
    recent = (period - cooldown[attacker] - damage_point[weapon] <= FLASH_LOOPS) & (at != NOBODY)
    return Strikes(attacker[recent], at[recent], melee[weapon[recent]])


def in_flight(world: World, player: int, *, through_fog: bool = False) -> InFlight | None:
    """Return the missiles that a player sees now, None if there are none."""
    missiles = world.missiles
    if not missiles:
        return None
    pos = np.array([(missile.x, missile.y) for missile in missiles])
    goal = np.array([(missile.shot.goal_x, missile.shot.goal_y) for missile in missiles])
    seen = np.ones(len(missiles), np.bool_) if through_fog else sees(world, player, pos)
    owner = np.array([missile.shot.owner for missile in missiles])[seen]
    told = np.where(owner == NEUTRAL, API_NEUTRAL, owner)
    return InFlight(pos[seen], goal[seen], told, alliance_of(owner, player))


@functools.cache
def _rhythm(catalog: Catalog) -> tuple[Floats, NDArray[np.bool_]]:
    """Return, by weapon, the loops from start to damage point, and whether it is melee."""
    weapons = catalog.weapons
    points = np.array([weapon.damage_point_loops for weapon in weapons])
    return points, np.array([weapon.melee for weapon in weapons], np.bool_)
