"""Larvae: town halls hatch them one by one, a Queen's injection several at once; they wander and need creep.

Each larva's ``home`` is its town hall. ``production`` has what a larva becomes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities.skill import Skill, distance, number
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

HALLS: Final = ("Hatchery", "Lair", "Hive")
INJECT = 251
INJECTED, WAITING = "QueenSpawnLarvaTimer", "QueenSpawnLarvaHiddenStack"
CONTAMINATED = "Contaminated"
NEXT: Final = "SpawnLarva"  # the timer of the next larva that hatches by itself
RING: Final = tuple(
    [(x, -3) for x in range(4)] + [(3, y) for y in range(-2, 4)] + [(x, 3) for x in range(2, -4, -1)]
    + [(-3, y) for y in range(2, -4, -1)] + [(-2, -3), (-1, -3)]
)  # fmt: skip
"""Where larvae hatch around the middle of their town hall, in this order (the catalog's)."""


def of(world: World, hall: int) -> Ints:
    """Return the slots of the larvae of a town hall, ascending."""
    live = world.live
    mine: Ints = live[(world.home[live] == hall) & (world.type[live] == _larva(world))]
    return mine


def _larva(world: World) -> int:
    return world.catalog.row_of_name["Larva"]


def hatch(world: World, hall: int, count: int = 1) -> None:
    """Hatch larvae beside a town hall, up to as many as it may have in all."""
    there = len(of(world, hall))
    x, y = world.pos[hall].tolist()
    for index in range(there, min(there + count, MECHANICS.larva_limit)):
        dx, dy = RING[index % len(RING)]
        larva = lifecycle.spawn(world, world.catalog.units[_larva(world)], int(world.owner[hall]), (x + dx, y + dy))
        world.home[larva] = hall


def _hatch_by_nature(world: World, slots: list[int]) -> None:
    """Hatch the next larva after a while at finished town halls with less than three."""
    live = world.live
    larvae = live[world.type[live] == _larva(world)]
    for larva in larvae[world.home[larvae] < 0].tolist():
        _adopt(world, larva, slots)
    counts = np.bincount(world.home[larvae][world.home[larvae] >= 0], minlength=world.capacity)
    for slot in slots:
        if world.build_progress[slot] < 1.0:
            continue
        timers = world.timers.setdefault(slot, {})
        if world.loop == 1 and NEXT not in timers:
            hatch(world, slot, max(MECHANICS.larvae_natural - int(counts[slot]), 0))
            counts[slot] = max(MECHANICS.larvae_natural, int(counts[slot]))
        if counts[slot] >= MECHANICS.larvae_natural:
            timers[NEXT] = math.inf
        elif timers.get(NEXT, math.inf) == math.inf:
            timers[NEXT] = world.loop + MECHANICS.larva_loops
        elif buffs.has(world, slot, CONTAMINATED):
            timers[NEXT] += 1
        elif timers[NEXT] <= world.loop:
            hatch(world, slot)
            timers[NEXT] = (
                math.inf if counts[slot] + 1 >= MECHANICS.larvae_natural else world.loop + MECHANICS.larva_loops
            )


def _adopt(world: World, larva: int, halls: list[int]) -> None:
    """Give a larva without a home to its owner's nearest town hall, if that is near."""
    x, y = world.pos[larva].tolist()
    mine = [(distance(world, hall, (x, y)), hall) for hall in halls if world.owner[hall] == world.owner[larva]]
    away, hall = min(mine, default=(math.inf, NOBODY))
    if away <= MECHANICS.larva_home:
        world.home[larva] = hall


# injections -----------------------------------------------------------------------------------------------------------


def _inject(world: World, cast: Cast) -> None:
    """Hatch three more larvae after a while; further injections wait for their turn."""
    buffs.apply(world, cast.target, WAITING if buffs.has(world, cast.target, INJECTED) else INJECTED, source=cast.slot)


def _is_hall(world: World, cast: Cast) -> ActionResult:
    fits = world.unit_type(cast.target).name in HALLS and not buffs.has(world, cast.target, CONTAMINATED)
    return ActionResult.SUCCESS if fits else ActionResult.CANT_TARGET_THAT_UNIT


def _injection_is_over(world: World, slot: int, row: np.void) -> None:
    """Hatch the larvae one after the other, and begin the next injection."""
    world.alert(int(world.owner[slot]), "LarvaHatched")
    numbers = world.catalog.ability(INJECT)
    count = int(number(numbers, "larva"))
    gap = MECHANICS.injected_larva_loops
    world.area_effects.append(
        AreaEffect("injected_larvae", int(row["owner"]), [(0.0, 0.0)], 0.0, world.loop, world.loop + count * gap,
              due=world.loop + gap, period=gap, target=world.tag_of(slot))
    )  # fmt: skip
    at = world.buffs.find(slot, world.catalog.buff(WAITING).row)
    if at < 0:
        return
    world.buffs.rows[at]["count"] -= 1
    if world.buffs.rows[at]["count"] <= 0:
        buffs.remove(world, slot, WAITING)
    buffs.apply(world, slot, INJECTED, owner=int(row["owner"]))


def _one_hatches(world: World, item: AreaEffect) -> None:
    hall = world.slot_of(item.target)
    if hall >= 0:
        hatch(world, hall)


# what larvae do -------------------------------------------------------------------------------------------------------


def _wander(world: World, slots: list[int]) -> None:
    """Move larvae a little now and then, near their town hall; off creep they die."""
    for slot in slots:
        if (world.loop - int(world.born_loop[slot])) % MECHANICS.larva_rest_loops:
            continue
        x, y = world.pos[slot].tolist()
        if not world.growth.covers(x, y):
            world.life[slot] = 0.0
        elif int(world.order_kind[slot]) == OrderKind.IDLE:
            _step(world, slot, x, y)


def _step(world: World, slot: int, x: float, y: float) -> None:
    """Send a larva a random step away; one that has gone too far comes back."""
    angle = 2.0 * math.pi * world.rng.random()
    far = MECHANICS.larva_step
    goal = (x + far * math.cos(angle), y + far * math.sin(angle))
    home = int(world.home[slot])
    if home >= 0:
        hx, hy = world.pos[home].tolist()
        place = (hx, hy + RING[0][1])
        if math.hypot(goal[0] - place[0], goal[1] - place[1]) > MECHANICS.larva_leash:
            away = math.hypot(place[0] - x, place[1] - y) or 1.0
            goal = (x + far * (place[0] - x) / away, y + far * (place[1] - y) / away)
    world.guard[slot] = goal
    world.returning[slot] = True


SKILLS: Final = {
    "spawn_larva": Skill(_inject, refuse=_is_hall, estimates=("How larvae wander.",)),
}
AREA_EFFECTS: Final = {"injected_larvae": _one_hatches}
ENDS: Final = {INJECTED: _injection_is_over}
PASSIVES: Final = {**dict.fromkeys(HALLS, _hatch_by_nature), "Larva": _wander}
