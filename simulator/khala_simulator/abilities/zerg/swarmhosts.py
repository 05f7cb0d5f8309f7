"""Swarm Hosts: two locusts hatch beside it, fly where they are sent, and swoop down on the enemies they meet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, number, place_of
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.launchers import LAUNCHERS
from khala_simulator.movement.placement import free_places
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

HATCHED, FLYING = "LocustMP", "LocustMPFlying"
STUNNED, SWOOPING = "LocustMPStun", "LocustMPFlyingSwoopUncommandable"
TAKE_OFF = 2385
SPAWN = 2704


def _spawn_locusts(world: World, cast: Cast) -> None:
    """Hatch two locusts, which attack towards a point and live for a while."""
    unit = world.catalog.unit(HATCHED)
    for slot in teleport.beside(world, cast.slot, unit, int(number(cast, "count"))):
        buffs.apply(world, slot, STUNNED, source=cast.slot)
        due = world.loop + number(cast, "spawn_stun_loops")
        world.area_effects.append(
            AreaEffect("locust_ready", int(world.owner[slot]), [place_of(world, cast)], 0.0, world.loop, due, due=due,
                  ability=cast.ability.id, target=world.tag_of(slot))
        )  # fmt: skip


def _ready(world: World, item: AreaEffect) -> None:
    slot = world.slot_of(item.target)
    if slot == NOBODY:
        return
    life = number(world.catalog.ability(item.ability), "locust_life_loops")
    extra = number(world.catalog.ability(item.ability), "life_random_loops")
    teleport.live_until(world, slot, world.loop + life + extra * world.rng.random())
    commands.begin(world, slot, Order(OrderKind.CAST, TAKE_OFF))
    commands.attack_move(world, [slot], item.at, queue=True)


# swooping -------------------------------------------------------------------------------------------------------------


def _swoop(world: World, cast: Cast) -> None:
    """Come down to the ground at a place."""
    _come_down(world, cast.slot, place_of(world, cast))


def _swoop_on(world: World, slot: int, target: int) -> None:
    if target != NOBODY:
        x, y = world.pos[target].tolist()
        _come_down(world, slot, (x, y))


def _come_down(world: World, slot: int, point: Point) -> None:
    """Become a locust on the ground that is on its way to a free place there."""
    ground = world.catalog.unit(HATCHED)
    (place,) = free_places(world, ground, point, 1)
    lifecycle.become(world, slot, ground)
    buffs.apply(world, slot, SWOOPING, source=slot)
    lasts = world.catalog.buff(SWOOPING).loops
    world.area_effects.append(
        AreaEffect(
            "swoop",
            owner=int(world.owner[slot]),
            points=[place],
            radius=MECHANICS.swoop_speed_n / LOOPS_PER_NORMAL_SECOND,
            begun=world.loop,
            end=world.loop + lasts,
            due=world.loop + 1,
            target=world.tag_of(slot),
        )
    )


def _glides(world: World, item: AreaEffect) -> None:
    """Bring a locust one step nearer to its landing place; the area effect's radius is the step."""
    slot = world.slot_of(item.target)
    if slot == NOBODY:
        item.end = world.loop
        return
    x, y = world.pos[slot].tolist()
    away = math.hypot(item.at[0] - x, item.at[1] - y)
    teleport.to(world, slot, teleport.within(world, slot, item.at, item.radius))
    if away <= item.radius or item.due > item.end:
        buffs.remove(world, slot, SWOOPING)
        item.end = world.loop


def _land(world: World, cast: Cast) -> None:
    """Stand on the ground from now on."""
    lifecycle.become(world, cast.slot, world.catalog.unit(cast.ability.unit))


LAUNCHERS["LocustMPFlyingSwoopWeapon"] = _swoop_on

SKILLS: Final = {
    "spawn_locusts_targeted": Skill(
        _spawn_locusts,
        estimates=("Where exactly the locusts hatch; they need no time to fall out of the host.",),
    ),
    "locust_mp_flying_swoop": Skill(_swoop, estimates=("How fast a locust swoops down.",)),
    "locust_mp_flying_swoop_attack": Skill(_swoop, estimates=("How fast a locust swoops down.",)),
    "land_locust": Skill(_land),
}
AREA_EFFECTS: Final = {"locust_ready": _ready, "swoop": _glides}
