"""What players and the debug interface may ask of the world, already validated.

Orders enter here: the API resolves the ability and the units; this module makes the order the units' current one or
puts it into their queues. Everything takes effect when the world next advances. Units that can't do what is asked are
left alone; the functions return the slots that took the order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import lifecycle, tags, targets
from khala_simulator.combat.traits import refresh
from khala_simulator.economy import harvesting
from khala_simulator.native import columns, memory
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import (
    ATTACK,
    HOLD_POSITION,
    KINDS,
    LOOKS_AROUND,
    MOVE,
    NEEDS_TARGET,
    PATROL,
    SCAN_MOVE,
    SEEKS_FIGHTS,
    WALKS,
    Order,
    OrderKind,
)
from khala_simulator.world.players import GameResult
from khala_simulator.world.world import NO_TAG

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

QUEUE_LIMIT = 32
IDLE: Final = int(OrderKind.IDLE)
WALK: Final = int(OrderKind.MOVE)
ATTACK_UNIT: Final = int(OrderKind.ATTACK_UNIT)
HOLD: Final = int(OrderKind.HOLD)
CAST: Final = int(OrderKind.CAST)
GATHER: Final = int(OrderKind.GATHER)
RETURN: Final = int(OrderKind.RETURN)

Point = tuple[float, float]


def move(world: World, slots: Iterable[int], point: Point, *, queue: bool = False) -> list[int]:
    """Walk to a point and ignore everyone on the way."""
    return [slot for slot in slots if send(world, slot, point, queue)]


def send(world: World, slot: int, point: Point, queue: bool = False) -> bool:
    """Make one unit walk as in `move`; return whether it took the order."""
    return can_move(world, slot) and _give(world, slot, WALK, MOVE, NO_TAG, _inside(world, point), None, queue)


def follow(world: World, slots: Iterable[int], target: int, *, queue: bool = False) -> list[int]:
    """Walk after another unit (a tag)."""
    takers = [s for s in slots if can_move(world, s) and world.tag_of(s) != target]
    return give(world, takers, Order(OrderKind.FOLLOW, MOVE, target=target), queue=queue)


def attack_move(world: World, slots: Iterable[int], point: Point, *, queue: bool = False) -> list[int]:
    """Walk to a point and fight enemies on the way; a unit without a weapon scan-moves."""
    taken: list[int] = []
    for slot in slots:
        if can_attack(world, slot):
            order = Order(OrderKind.ATTACK_MOVE, ATTACK, point=_inside(world, point))
        elif can_move(world, slot):
            order = Order(OrderKind.SCAN_MOVE, SCAN_MOVE, point=_inside(world, point))
        else:
            continue
        taken += give(world, [slot], order, queue=queue)
    return taken


def attack_unit(world: World, slots: Iterable[int], target: int, *, queue: bool = False) -> list[int]:
    """Attack one unit (a tag) until it is dead; allies too, if the order says so."""
    return [slot for slot in slots if set_on(world, slot, target, queue)]


def set_on(world: World, slot: int, target: int, queue: bool = False) -> bool:
    """Make one unit attack as in `attack_unit`; return whether it took the order."""
    victim = tags.slot_of(columns.columns_of(world), target)
    if victim in (NOBODY, slot) or not can_reach(world, slot, victim):
        return False
    return _give(world, slot, ATTACK_UNIT, ATTACK, target, None, None, queue)


def patrol(world: World, slots: Iterable[int], point: Point, *, queue: bool = False) -> list[int]:
    """Go back and forth between here and a point, fighting enemies on the way."""
    taken: list[int] = []
    for slot in slots:
        if can_move(world, slot):
            x, y = world.pos[slot]
            order = Order(OrderKind.PATROL, PATROL, point=_inside(world, point), origin=(float(x), float(y)))
            taken += give(world, [slot], order, queue=queue)
    return taken


def stop(world: World, slots: Iterable[int], *, queue: bool = False) -> list[int]:
    """Drop all orders; queued, it ends the queue there."""
    return [slot for slot in slots if halt(world, slot, queue)]


def halt(world: World, slot: int, queue: bool = False) -> bool:
    """Make one unit drop its orders as in `stop`; return whether it took the order."""
    c = columns.columns_of(world)
    if not _commandable(world, c.type[slot]):
        return False
    if not queue:
        world.queue[slot] = []
        if not c.bound[slot]:
            begin(world, slot, None)
    return True


def hold(world: World, slots: Iterable[int], *, queue: bool = False) -> list[int]:
    """Stay on the spot and fight only enemies in reach."""
    takers = [s for s in slots if can_move(world, s)]
    return give(world, takers, Order(OrderKind.HOLD, HOLD_POSITION), queue=queue)


def smart(
    world: World, slots: Iterable[int], *, point: Point | None = None, target: int = NO_TAG, queue: bool = False
) -> list[int]:
    """Right-click: attack an enemy, harvest a resource, drop off a load, follow any other unit, walk to a point."""
    victim = world.slot_of(target)
    if victim == NOBODY:
        return [] if point is None else move(world, slots, point, queue=queue)
    slots = list(slots)
    foes = [s for s in slots if is_enemy(world, int(world.owner[s]), int(world.owner[victim]))]
    taken = attack_unit(world, foes, target, queue=queue) + gather(world, slots, target, queue=queue)
    if harvesting.is_drop_off(world, victim):
        loaded = [s for s in slots if world.load[s] and world.owner[s] == world.owner[victim]]
        taken += return_cargo(world, loaded, queue=queue)
    rest = [s for s in slots if s not in taken]
    return taken + follow(world, rest, target, queue=queue)


def gather(world: World, slots: Iterable[int], target: int, *, queue: bool = False) -> list[int]:
    """Harvest a mineral field or a gas structure (a tag) until another order comes."""
    resource = world.slot_of(target)
    taken: list[int] = []
    for slot in slots:
        if harvesting.can_harvest(world, slot, resource):
            ability = harvesting.harvesters(world.catalog)[int(world.type[slot])][0]
            taken += give(world, [slot], Order(OrderKind.GATHER, ability.id if ability else 0, target), queue=queue)
    return taken


def return_cargo(world: World, slots: Iterable[int], *, queue: bool = False) -> list[int]:
    """Carry the load to the nearest town hall, and go on harvesting."""
    taken: list[int] = []
    for slot in slots:
        ability = harvesting.harvesters(world.catalog)[int(world.type[slot])][1]
        if ability is not None and (queue or world.load[slot]):
            taken += give(world, [slot], Order(OrderKind.RETURN, ability.id), queue=queue)
    return taken


def surrender(world: World, player: int) -> None:
    """Give up: defeat for the player, and victory for the last player that has not given up."""
    world.players[player].surrendered = True
    playing = [p for p in world.players[1:] if not p.surrendered]
    if len(playing) <= 1:
        results = {p.id: GameResult.DEFEAT if p.surrendered else GameResult.VICTORY for p in world.players[1:]}
        world.end(results)


def debug_kill(world: World, tags: Iterable[int]) -> None:
    """Kill units; unknown tags are ignored. They die when the world next advances, and no player gets the credit."""
    for tag in tags:
        slot = world.slot_of(tag)
        if slot != NOBODY:
            world.life[slot] = 0.0
            world.attacker[slot] = NOBODY


def debug_create(world: World, type_id: int, owner: int, point: Point, quantity: int = 1) -> list[int]:
    """Create complete units exactly at one point, on top of each other; return their slots."""
    unit = world.catalog.unit(type_id)
    return [lifecycle.spawn(world, unit, owner, point) for _ in range(quantity)]


def debug_set_value(world: World, tag: int, *, life: float | None = None, shields: float | None = None,
                    energy: float | None = None) -> None:  # fmt: skip
    """Set a unit's life, shields or energy, within what its type can have; unknown tags are ignored."""
    slot = world.slot_of(tag)
    if slot == NOBODY or world.life[slot] <= 0.0:
        return
    at = (int(world.owner[slot]), int(world.type[slot]))
    if life is not None:
        world.life[slot] = min(life, world.stats.life_max[at])
    if shields is not None:
        world.shields[slot] = min(shields, world.stats.shields_max[at])
    if energy is not None:
        world.energy[slot] = min(energy, world.stats.energy_max[at])


def debug_switch(world: World, player: int, name: str) -> None:
    """Switch a debug state of a player on, or off again."""
    cheats = world.players[player].cheats
    if name in cheats:
        cheats.remove(name)
    else:
        cheats.append(name)
    for slot in world.units_of(player).tolist():
        refresh(world, slot)


def debug_upgrade(world: World, player: int) -> None:
    """Give a player every upgrade that can be researched; of those with levels the next level."""
    before = {upgrade.name for upgrade in world.catalog.upgrades if upgrade.id in world.players[player].upgrades}
    for ability in world.catalog.abilities:
        if ability.effect == "research" and _level_before(ability.upgrade) in {"", *before}:
            grant_upgrade(world, player, world.catalog.upgrade(ability.upgrade).id)


def _level_before(upgrade: str) -> str:
    """Return the name of the level before that of an upgrade, empty for the first one and for those without levels."""
    name, _, level = upgrade.rpartition("Level")
    return f"{name}Level{int(level) - 1}" if name and level.isdigit() and int(level) > 1 else ""


def grant_upgrade(world: World, player: int, upgrade_id: int) -> None:
    """Give a player a finished upgrade; its numbers count from now on, and more life is there at once."""
    owned = world.players[player].upgrades
    if upgrade_id not in owned:
        owned.append(world.catalog.upgrade(upgrade_id).id)
        owned.sort()
        world.stats.apply(player, owned)
        for slot in np.flatnonzero(world.alive & (world.owner == player)).tolist():
            before = float(world.life_max[slot])
            refresh(world, slot)
            if world.life[slot] > 0.0:
                world.life[slot] += max(float(world.life_max[slot]) - before, 0.0)


# what a unit can do ---------------------------------------------------------------------------------------------------


def _soon(world: World, slot: int) -> int:
    """Return the row of a unit's type, or of the type that it is morphing into."""
    c = columns.columns_of(world)
    now: int = c.type[slot]
    if c.bound[slot] and c.casts[slot]:
        row = world.catalog.row_of_name.get(world.catalog.ability(int(world.order_ability[slot])).unit)
        if row is not None:
            return int(row)
    return now


def can_move(world: World, slot: int) -> bool:
    """Return whether a unit takes movement orders: its type, or the next one, has a speed or gets one by upgrade."""
    row = _soon(world, slot)
    stats = world.stats
    step = memory.floats(stats.step)[columns.columns_of(world).owner[slot] * stats.types + row]
    return step > 0.0 and _commandable(world, row)


def can_attack(world: World, slot: int) -> bool:
    """Return whether the unit has a weapon that it can aim now."""
    c = columns.columns_of(world)
    armed = c.ground_weapon[slot] >= 0 or c.air_weapon[slot] >= 0
    return armed and _commandable(world, c.type[slot])


def can_reach(world: World, slot: int, victim: int) -> bool:
    """Return whether the unit has a weapon that it can aim at ``victim`` now."""
    c = columns.columns_of(world)
    if memory.bools(world.stats.untargetable)[c.type[victim]] or not _commandable(world, c.type[slot]):
        return False
    return targets.weapon_for(world, slot, victim) >= 0


def is_enemy(world: World, player: int, other: int) -> bool:
    """Return whether two owners fight each other; no unit attacks the neutral player unless ordered."""
    return player != other and 0 not in (player, other) and len(world.players) > max(player, other)


def _commandable(world: World, row: int) -> bool:
    return not memory.bools(world.stats.uncommandable)[row]


def _inside(world: World, point: Point) -> Point:
    x, y = point
    return min(max(x, world.west), world.east), min(max(y, world.south), world.north)


def give(world: World, slots: list[int], order: Order, *, queue: bool) -> list[int]:
    """Make an order the units' current one, or append it to their queues; return the slots that took it."""
    kind, ability, target, point, origin, _ = order
    return [slot for slot in slots if _give(world, slot, int(kind), ability, target, point, origin, queue)]


def _give(
    world: World,
    slot: int,
    kind: int,
    general: int,
    target: int,
    point: Point | None,
    origin: Point | None,
    queue: bool,
) -> bool:
    """Give one unit an order; return whether it took it. It is a value only while it waits."""
    c = columns.columns_of(world)
    if c.carrier[slot] != NOBODY:
        return False  # a passenger takes no orders
    ability = _of_its_own(world, c.type[slot], kind, general)
    waits = queue and c.order_kind[slot] != IDLE
    if waits and len(world.queue[slot]) >= QUEUE_LIMIT:
        return False
    if not waits:
        world.queue[slot] = []
    if waits or c.bound[slot]:
        world.queue[slot].append(Order(OrderKind(kind), ability, target, point, origin))
    else:
        _begin(world, slot, kind, ability, target, point, origin)
    return True


def _of_its_own(world: World, row: int, kind: int, general: int) -> int:
    """Return the ability id that a type of units has for an order; a Battlecruiser has its own move."""
    if kind == IDLE or general not in (MOVE, PATROL, HOLD_POSITION, SCAN_MOVE, ATTACK):
        return general
    own = memory.ints(world.usual)[row * KINDS + kind]
    return general if own < 0 else own


def begin(world: World, slot: int, order: Order | None) -> None:
    """Make ``order`` the unit's current one (None: idle), dropping an attack that has not taken effect yet.

    An order to seek fights leaves a unit in the one that it has found by itself: an attack-move that is given again
    and again interrupts nothing. A unit that goes around others goes on doing so where that leads to the new goal.
    """
    if order is None:
        _begin(world, slot, IDLE, 0, NO_TAG, None, None)
    else:
        _begin(world, slot, int(order.kind), order.ability, order.target, order.point, order.origin)


def _begin(
    world: World, slot: int, kind: int, ability: int, tag: int, point: Point | None, origin: Point | None
) -> None:
    c = columns.columns_of(world)
    target = tags.slot_of(c, tag)
    opponent = c.target[slot]
    fights_on = SEEKS_FIGHTS >> kind & LOOKS_AROUND >> c.order_kind[slot] & 1 != 0
    if c.harvest[slot]:
        _end_harvest(world, slot)
    c.order_kind[slot] = kind
    c.on_guard[slot] = False
    c.order_ability[slot] = ability
    c.order_target[slot] = target
    c.order_point[slot] = _point(point, c.pos[slot])
    c.order_aimed[slot] = point is not None
    c.order_origin[slot] = _point(origin, c.pos[slot])
    attacks = kind == ATTACK_UNIT and target != NOBODY and targets.engage(world, slot, target)
    if not (attacks or fights_on):
        targets.disengage(world, slot)
    casts = kind == CAST
    c.walks[slot] = WALKS >> kind & 1 != 0
    c.looks_around[slot] = LOOKS_AROUND >> kind & 1 != 0
    c.holds[slot] = kind == HOLD
    c.needs_target[slot] = NEEDS_TARGET >> kind & 1 != 0 or (casts and target != NOBODY)
    c.casts[slot] = casts
    c.cast_at[slot] = -1.0
    c.channels[slot] = False
    c.bound[slot] = False
    world.scan_now = True
    world.orders_changed = True
    c.guard[slot] = c.pos[slot]
    if opponent == NOBODY or c.target[slot] != opponent:
        c.backswing[slot] = 0.0
    c.returning[slot] = False
    c.nav_end[slot] = False
    c.nav_loop[slot] = 0
    if _leads_away(c, slot):
        c.blocked[slot] = 0
        c.detour[slot] = 0
    c.scan_loop[slot] = 0
    if kind in (GATHER, RETURN):
        _begin_harvest(world, slot, kind, target)


def _point(given: Point | None, place: memory.Point) -> memory.Point:
    """Return a given point, or the place of the unit if there is none."""
    if given is None:
        return place
    x, y = given
    return memory.point(x, y)


def _leads_away(c: Columns, slot: int) -> bool:
    """Return whether a unit's way around others leads away from where its order takes it."""
    target = c.order_target[slot]
    goal = c.order_point[slot] if target == NOBODY else c.pos[target]
    x = goal.x - c.pos[slot].x
    y = goal.y - c.pos[slot].y
    return x * c.aside[slot].x + y * c.aside[slot].y < 0.0


def _begin_harvest(world: World, slot: int, kind: int, target: int) -> None:
    """Begin a round of harvesting; other bodies are no obstacle on it."""
    world.harvesting = True
    if kind == GATHER and target != NOBODY:
        harvesting.head_for_resource(world, slot, target)
    elif not harvesting.head_for_hall(world, slot):
        begin(world, slot, None)
        return
    refresh(world, slot)


def _end_harvest(world: World, slot: int) -> None:
    harvesting.leave(world, slot)
    world.harvest[slot] = harvesting.Phase.NONE
    refresh(world, slot)


def begin_next(world: World, slot: int) -> None:
    """Begin the next order of a unit; a patrol turns round, orders whose target is gone are skipped."""
    waiting = world.queue[slot]
    if int(world.order_kind[slot]) == OrderKind.PATROL and not waiting:
        here, there = world.order_point[slot].copy(), world.order_origin[slot].copy()
        world.order_point[slot], world.order_origin[slot] = there, here
        world.nav_end[slot] = False
        world.nav_loop[slot] = world.blocked[slot] = world.detour[slot] = 0
        return
    order: Order | None = None
    while waiting and order is None:
        order = waiting.pop(0)
        if order.target != NO_TAG and world.slot_of(order.target) == NOBODY:
            order = None
    begin(world, slot, order)
