"""Broodlings: the Brood Lord throws them at what it attacks, and Zerg structures leave some when they are destroyed.

A thrown broodling hurts its target where it lands, as the Brood Lord's weapon, and then fights for a few seconds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.combat import lifecycle
from khala_simulator.combat.launchers import LAUNCHERS
from khala_simulator.movement.placement import free_places
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import PendingHit, Shot

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World

WEAPON, ESCORT = "BroodlingStrike", "BroodlingEscort"
BROODLING, LIFE = "Broodling", "BroodlingFate"
AT_STRUCTURE, AT_UNIT = "IsStructure", "else"
LARGE: Final = ("Hatchery", "Lair", "Hive")
SMALL: Final = (
    "SpawningPool", "EvolutionChamber", "HydraliskDen", "Spire", "UltraliskCavern", "InfestationPit", "NydusNetwork",
    "BanelingNest", "RoachWarren", "GreaterSpire", "LurkerDenMP",
)  # fmt: skip


def _throw(world: World, slot: int, target: int) -> None:
    """Throw a broodling: its hit flies as a missile, and the broodling fights on where that lands."""
    if target == NOBODY:
        return
    escort = next(w for w in world.catalog.weapons if w.id == ESCORT)
    branch = AT_STRUCTURE if world.unit_type(target).structure else AT_UNIT
    index = next(i for i, hit in enumerate(escort.hits) if hit.when == branch and hit.damage)
    owner = int(world.owner[slot])
    shot = Shot(slot, owner, target, NOBODY, escort.row, index, world.pos[slot], world.pos[target])
    world.pending.append(PendingHit(shot, world.loop))
    if world.hallucination[slot]:
        return
    (x, y), (a, b) = world.pos[slot].tolist(), world.pos[target].tolist()
    speed_n = escort.hits[index].missile_speed_n or math.inf
    flies = math.ceil(math.hypot(a - x, b - y) / speed_n * LOOPS_PER_NORMAL_SECOND)
    world.area_effects.append(
        AreaEffect("broodling", owner, [(a, b)], 0.0, world.loop, world.loop + flies, due=world.loop + flies,
              target=world.tag_of(target))
    )  # fmt: skip


def _lands(world: World, item: AreaEffect) -> None:
    target = world.slot_of(item.target)
    x, y = world.pos[target].tolist() if target != NOBODY else item.at
    (slot,) = hatch(world, item.owner, (x, y), 1)
    if target != NOBODY:
        commands.attack_unit(world, [slot], item.target)


def hatch(world: World, owner: int, point: Point, count: int) -> list[int]:
    """Spawn broodlings around a point, for a few seconds."""
    unit = world.catalog.unit(BROODLING)
    slots = [lifecycle.spawn(world, unit, owner, place) for place in free_places(world, unit, point, count)]
    for slot in slots:
        chance = MECHANICS.broodling_random_loops * world.rng.random()
        teleport.live_until(world, slot, world.loop + world.catalog.buff(LIFE).loops + chance)
    return slots


def _leaves(count: int) -> Callable[[World, int], None]:
    """Spawn the broodlings that a destroyed structure leaves."""

    def rule(world: World, slot: int) -> None:
        if world.build_progress[slot] >= 1.0:
            x, y = world.pos[slot].tolist()
            hatch(world, int(world.owner[slot]), (x, y), count)

    return rule


LAUNCHERS[WEAPON] = _throw

AREA_EFFECTS: Final = {"broodling": _lands}
DEATHS: Final = {**{name: _leaves(9) for name in LARGE}, **{name: _leaves(6) for name in SMALL}}
