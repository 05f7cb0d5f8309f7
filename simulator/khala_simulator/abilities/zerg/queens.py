"""The Queen's Transfusion, and creep tumors: the Queen's first one, and those that tumors plant themselves."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.skill import Skill, number, place_of
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.healing import heal, is_hurt
from khala_simulator.economy import building_sites, construction
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    import numpy as np

    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

TRANSFUSION = 1664
PLANT, BURROW = 1733, 1662


# Transfusion ----------------------------------------------------------------------------------------------------------


def _transfuse(world: World, cast: Cast) -> None:
    """Heal a biological friend at once, and some more over time."""
    heal(world, cast.target, number(cast, "instant_life"))
    buffs.apply(world, cast.target, "Transfusion", source=cast.slot)


def _needs_life(world: World, cast: Cast) -> ActionResult:
    return ActionResult.SUCCESS if is_hurt(world, cast.target) else ActionResult.REQUIRES_HEAL_TARGET


def _heal_tick(world: World, slot: int, _: np.void) -> None:
    ability = world.catalog.ability(TRANSFUSION)
    heal(world, slot, number(ability, "hot_life_total") / number(ability, "hot_duration_loops"))


# creep tumors ---------------------------------------------------------------------------------------------------------


def _plant(world: World, cast: Cast) -> None:
    """Plant a creep tumor, which grows by itself and then burrows."""
    slot = cast.slot
    unit = world.catalog.unit(cast.ability.unit)
    place = building_sites.centre(world, unit, place_of(world, cast))
    loops = cast.ability.loops
    if cast.ability.id == PLANT:
        loops += math.dist(world.pos[slot].tolist(), place) / MECHANICS.tumor_throw_speed
    construction.begin(world, unit, int(world.owner[slot]), place, loops=loops, paid=(0.0, 0.0))
    if cast.ability.id == PLANT:
        world.timers.setdefault(slot, {})[cast.ability.timer] = math.inf  # a tumor plants one other in its life


def _room_for_tumor(world: World, cast: Cast) -> ActionResult:
    """Return why there is no room: it takes creep without a structure, and sight for a tumor's own."""
    unit = world.catalog.unit(cast.ability.unit)
    owner = int(world.owner[cast.slot])
    return building_sites.refusal(world, owner, unit, place_of(world, cast), on_site=cast.is_carried_out)


def _burrow_when_grown(world: World, slots: list[int]) -> None:
    """Burrow finished tumors."""
    for slot in slots:
        if world.build_progress[slot] >= 1.0 and int(world.order_kind[slot]) == OrderKind.IDLE:
            commands.begin(world, slot, Order(OrderKind.CAST, BURROW))


def _burrow_tumor(world: World, cast: Cast) -> None:
    """Burrow a finished tumor, which can plant another one after a while."""
    slot = cast.slot
    finished = float(world.cast_begun[slot]) - 1.0  # it began to burrow in the loop after
    lifecycle.become(world, slot, world.catalog.unit(cast.ability.unit))
    plant = world.catalog.ability(PLANT)
    world.timers.setdefault(slot, {})[plant.timer] = finished + number(plant, "first_use_after_loops")


SKILLS: Final = {
    "transfusion": Skill(_transfuse, refuse=_needs_life),
    "creep_tumor": Skill(_plant, refuse=_room_for_tumor),
    "burrow_tumor": Skill(_burrow_tumor, binds=True),
}
TICKS: Final = {"Transfusion": _heal_tick}
PASSIVES: Final = {"CreepTumor": _burrow_when_grown, "CreepTumorQueen": _burrow_when_grown}
