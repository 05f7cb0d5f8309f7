"""The Queen's Transfusion, and creep tumors: the Queen's first one, and those that tumors plant themselves."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from simulator import buffs, commands
from simulator.orders import Order, OrderKind
from simulator.refusal import Refusal
from simulator.skills.skill import Skill, number, place_of
from simulator.systems.placement import snapped

if TYPE_CHECKING:
    import numpy as np

    from simulator.casts import Cast
    from simulator.world import World

TRANSFUSION = 1664
PLANT, BURROW = 1733, 1662
HALF_CELL = (1, 1)
SEEN = 2
FIRST_PROGRESS = 1e-3


# Transfusion ----------------------------------------------------------------------------------------------------------


def _transfuse(world: World, cast: Cast) -> None:
    """Heal a biological friend at once, and some more over time."""
    _heal(world, cast.target, number(cast, "instant_life"))
    buffs.apply(world, cast.target, "Transfusion", source=cast.slot)


def _needs_life(world: World, cast: Cast) -> Refusal:
    hurt = world.life[cast.target] < world.life_max[cast.target]
    return Refusal.SUCCESS if hurt else Refusal.REQUIRES_HEAL_TARGET


def _heal_tick(world: World, slot: int, _: np.void) -> None:
    ability = world.catalog.ability(TRANSFUSION)
    _heal(world, slot, number(ability, "hot_life_total") / number(ability, "hot_duration_loops"))


def _heal(world: World, slot: int, amount: float) -> None:
    before = float(world.life[slot])
    world.life[slot] = min(before + amount, float(world.life_max[slot]))
    world.players[int(world.owner[slot])].score.healed.life += float(world.life[slot]) - before


# creep tumors ---------------------------------------------------------------------------------------------------------


def _plant(world: World, cast: Cast) -> None:
    """Plant a creep tumor, which grows by itself and then burrows."""
    slot, unit = cast.slot, world.catalog.unit(cast.ability.unit)
    tumor = world.spawn(unit, int(world.owner[slot]), snapped(place_of(world, cast), HALF_CELL))
    world.build_progress[tumor] = FIRST_PROGRESS
    world.build_loops[tumor] = cast.ability.loops
    world.self_made[tumor] = True
    world.refresh(tumor)
    if cast.ability.id == PLANT:
        world.timers.setdefault(slot, {})[cast.ability.timer] = math.inf  # a tumor plants one other in its life


def _room_for_tumor(world: World, cast: Cast) -> Refusal:
    """Creep that is seen, and no structure there."""
    x, y = snapped(place_of(world, cast), HALF_CELL)
    width, height = world.map.terrain.size
    if not (0 <= x < width and 0 <= y < height):
        return Refusal.CANT_FIND_PLACEMENT_LOCATION
    row, column = int(y), int(x)
    if world.visibility[int(world.owner[cast.slot]), row, column] != SEEN and cast.ability.id == PLANT:
        return Refusal.CANT_SEE_BUILD_LOCATION
    if not world.creep[row, column]:
        return Refusal.CANT_BUILD_TOO_FAR_FROM_CREEP_SOURCE
    return Refusal.SUCCESS if world.ground.walk[row, column] else Refusal.CANT_FIND_PLACEMENT_LOCATION


def _burrow_when_grown(world: World, slots: list[int]) -> None:
    """A finished tumor goes under the ground by itself."""
    for slot in slots:
        if world.build_progress[slot] >= 1.0 and world.order_kind[slot] == OrderKind.IDLE:
            commands.begin(world, slot, Order(OrderKind.CAST, BURROW))


def _burrow_tumor(world: World, cast: Cast) -> None:
    """Go under the ground, and be able to plant another tumor after a while."""
    slot = cast.slot
    world.become(slot, world.catalog.unit(cast.ability.unit))
    plant = world.catalog.ability(PLANT)
    world.timers.setdefault(slot, {})[plant.timer] = world.loop + number(plant, "first_use_after_loops")


SKILLS: Final = {
    "transfusion": Skill(_transfuse, refuse=_needs_life),
    "creep_tumor": Skill(_plant, refuse=_room_for_tumor),
    "burrow_tumor": Skill(_burrow_tumor, binds=True),
}
TICKS: Final = {"Transfusion": _heal_tick}
PASSIVES: Final = {"CreepTumor": _burrow_when_grown, "CreepTumorQueen": _burrow_when_grown}
