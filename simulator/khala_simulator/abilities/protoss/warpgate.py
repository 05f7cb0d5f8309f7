"""The skill of Warp Gates: warping a unit into a power field, from far away.

The unit appears at once, but is helpless and vulnerable until it is finished: soon in a field near a Nexus, a Gateway
or a Warp Prism, later in others. The gate then has a cooldown before the next one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import fog
from khala_simulator.economy import construction, payments, power
from khala_simulator.movement import pathfinding
from khala_simulator.tables import prices
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.layers import layer_of

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import UnitRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

FAST_RATE: Final = 3.2
FIXED_POINT: Final = 4096.0
"""The game's numbers have 12 bits behind the point. So 3.2 is a little less, and 256 loops of work take 81, not 80."""
TIMER: Final = "WarpGateTrain"


def _warp_in(world: World, slots: list[int], ability: Ability, _: int, point: Point | None, __: bool) -> list[int]:
    """Warp a unit in from the first gate that is ready."""
    if point is None:
        return []
    slot = slots[0]
    owner = int(world.owner[slot])
    unit = world.catalog.unit(ability.unit)
    source = power.best(world, owner, point)
    if source is None or not _is_free(world, unit, point):
        return []
    paid = payments.charge(world, owner, prices.cost_of(ability))
    loops = work_loops(ability, fast=source.fast) + construction.SEEN_LATER
    construction.begin(world, unit, owner, point, loops=loops, paid=paid)
    if ability.charges is not None:
        world.timers.setdefault(slot, {})[ability.timer] = world.loop + ability.charges.loops
    return [slot]


def work_loops(ability: Ability, *, fast: bool) -> float:
    """Return the loops from the moment at which a unit is first seen until it is finished."""
    slow = float(ability.numbers.get("slow_time_loops", ability.loops))
    if not fast:
        return slow
    rate = float(ability.numbers.get("fast_rate_multiplier", FAST_RATE))
    return math.ceil(slow * FIXED_POINT / math.floor(rate * FIXED_POINT))


def _can_warp_in(world: World, cast: Cast) -> ActionResult:
    if cast.point is None:
        return ActionResult.CANT_FIND_PLACEMENT_LOCATION
    return refusal(world, int(world.owner[cast.slot]), world.catalog.unit(cast.ability.unit), cast.point)


def refusal(world: World, player: int, unit: UnitType, point: Point) -> ActionResult:
    """Return why a player can't warp a unit in at a point, or success."""
    if power.best(world, player, point) is None:
        return ActionResult.CANT_BUILD_TOO_FAR_FROM_POWER
    known_free = _is_free(world, unit, point, player=player)
    return ActionResult.SUCCESS if known_free else ActionResult.CANT_WARP_IN_UNITS_THERE


def _is_free(world: World, unit: UnitType, point: Point, *, player: int | None = None) -> bool:
    """Return whether a unit's body touches no wall and no other body at a point; a player asks of the known ones."""
    at = np.array([point])
    surface = pathfinding.surface(world.ground, layer_of(unit))
    if not surface.flat[surface.cell(at)][0]:
        return False
    live = world.live
    bodies = live[(world.layer[live] != 2) & ~world.walled[live] & (world.separation[live] > 0.0)]
    offset = world.pos[bodies] - at
    apart = (world.separation[bodies] + unit.separation) * 0.98
    touched = bodies[offset[:, 0] ** 2 + offset[:, 1] ** 2 < apart**2]
    return len(touched) == (0 if player is None else len(fog.unknown_to(world, player, touched)))


def _hurry(world: World, slots: list[int]) -> None:
    """Shorten a gate's cooldown while it works faster, as under Chrono Boost."""
    if not len(world.buffs):
        return
    for slot in slots:
        waits = world.timers.get(slot, {})
        rate = float(world.work_rate[slot])
        if rate != 1.0 and waits.get(TIMER, 0.0) > world.loop:
            waits[TIMER] -= rate - 1.0


PASSIVES: Final[dict[str, UnitRule]] = {"WarpGate": _hurry}
SKILLS: Final = {
    "warp_in": Skill(
        give=_warp_in,
        refuse=_can_warp_in,
        estimates=(
            "Of several Warp Gates the first that is ready warps in.",
            "A unit that is being warped in has all its life and shields from the beginning.",
        ),
    )
}
