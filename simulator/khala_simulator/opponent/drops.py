"""Drops: a transport takes part of the army over the edge of the map into an enemy base.

A drop loads where the army waits, flies, unloads between the workers, and fights there until it is dead or its time is
over; who is left joins the army.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.opponent import hands, products, stance
from khala_simulator.opponent.levels import FASTER_LOOPS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.opponent_memory import DropMemory
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.world.casts import Point

FIRST_S: Final = 480.0
BETWEEN_S: Final = 110.0
LOAD_S: Final = 14.0
FLY_S: Final = 90.0
FIGHT_S: Final = 45.0
LEAST_ARMY: Final = 36.0
"""Army supply below which no part of it is sent away."""
NEAR: Final = 7.0
UNLOAD: Final = "unload_all_at"
FIGHTS: Final = frozenset({"Marine", "Marauder", "Zealot", "Adept", "Zergling", "Roach", "Hellion"})


def lead(side: OwnSide, enemy: Enemy) -> None:
    """Begin a drop when its time has come, or lead the one that is under way."""
    drop = side.mind.drop
    if drop.phase:
        PHASES[drop.phase](side)
    elif "drop" in side.level.skills and side.mind.threat is None:
        _begin(side, enemy)


def _begin(side: OwnSide, enemy: Enemy) -> None:
    world, mind = side.world, side.mind
    if world.loop < mind.next_drop or side.clock_s < FIRST_S or side.army_supply < LEAST_ARMY or mind.attacking:
        return
    transport = _transport(side)
    squad = _squad(side, transport) if transport != NOBODY else []
    if len(squad) < 2:
        return
    tags = [world.tag_of(slot) for slot in squad]
    mind.drop = DropMemory("load", world.loop, world.tag_of(transport), tags, _target(side, enemy))
    hands.smart(side, squad, world.tag_of(transport))


def _transport(side: OwnSide) -> int:
    """Return a transport at home; without one it is made, for a later drop."""
    rally = stance.rally(side)
    name = side.race.transport
    found = [s for s in side.of_type(name) if math.dist(side.place(s), rally) < 40.0]
    if not found and not side.count(name):
        products.make(side, name)
    return min(found, key=lambda s: (math.dist(side.place(s), rally), s), default=NOBODY)


def _squad(side: OwnSide, transport: int) -> list[int]:
    """Return the units nearest to a transport that fill it."""
    world, space = side.world, side.world.unit_type(transport).cargo_space
    able = [s for s in side.army if world.unit_type(s).name in FIGHTS and world.target[s] == NOBODY]
    able.sort(key=lambda s: (math.dist(side.place(s), side.place(transport)), s))
    squad: list[int] = []
    for slot in able:
        size = world.unit_type(slot).cargo_size
        if size <= space and math.dist(side.place(slot), side.place(transport)) < 15.0:
            squad.append(slot)
            space -= size
    return squad


def _target(side: OwnSide, enemy: Enemy) -> Point:
    """Return where the resources of the enemy's base are that is farthest from the own front."""
    world = side.world
    halls = [s for s in enemy.structures.tolist() if "DropOff" in world.unit_type(s).placement]
    places = [side.place(hall) for hall in halls] or [side.mind.enemy_start]
    home = stance.rally(side)
    x, y = max(places, key=lambda p: (math.dist(p, home), p))
    near = [r for r in side.mind.resources if math.dist(r, (x, y)) < 10.0] or [(x, y)]
    mx, my = sum(p[0] for p in near) / len(near), sum(p[1] for p in near) / len(near)
    return (x + mx) / 2.0, (y + my) / 2.0


# phases ---------------------------------------------------------------------------------------------------------------


def _load(side: OwnSide) -> None:
    drop, world = side.mind.drop, side.world
    transport = world.slot_of(drop.transport)
    if transport == NOBODY:
        _end(side)
        return
    outside = [s for s in map(world.slot_of, drop.squad) if s != NOBODY and world.carrier[s] == NOBODY]
    late = world.loop - drop.since > LOAD_S * FASTER_LOOPS
    if outside and not late:
        return
    drop.squad = [tag for tag in drop.squad if world.slot_of(tag) not in outside]
    unload = next((a for a in world.catalog.abilities_of(int(world.type[transport])) if a.effect == UNLOAD), None)
    if not drop.squad or unload is None:  # it has become something that carries nothing
        _end(side)
    elif hands.use(side, [transport], unload, point=drop.target):
        drop.phase = "fly"
        drop.since = world.loop


def _fly(side: OwnSide) -> None:
    drop, world = side.mind.drop, side.world
    squad = [s for s in map(world.slot_of, drop.squad) if s != NOBODY]
    out = [s for s in squad if world.carrier[s] == NOBODY]
    late = world.loop - drop.since > FLY_S * FASTER_LOOPS
    if not squad or (late and not out):
        _end(side)
    elif len(out) == len(squad) or late:
        drop.phase = "fight"
        drop.since = world.loop
        _send_home(side)


def _fight(side: OwnSide) -> None:
    drop, world = side.mind.drop, side.world
    squad = [s for s in map(world.slot_of, drop.squad) if s != NOBODY and world.carrier[s] == NOBODY]
    if not squad or world.loop - drop.since > FIGHT_S * FASTER_LOOPS:
        _end(side)
        return
    idle = [s for s in squad if int(world.order_kind[s]) == OrderKind.IDLE and world.target[s] == NOBODY]
    if idle:
        hands.attack(side, idle, drop.target)


def _send_home(side: OwnSide) -> None:
    transport = side.world.slot_of(side.mind.drop.transport)
    if transport != NOBODY:
        hands.move(side, [transport], stance.rally(side))


def _end(side: OwnSide) -> None:
    """Give the rest of the drop back to the army."""
    side.mind.drop = DropMemory()
    side.mind.next_drop = side.world.loop + round(BETWEEN_S * FASTER_LOOPS)


PHASES: Final[dict[str, Callable[[OwnSide], None]]] = {"load": _load, "fly": _fly, "fight": _fight}
