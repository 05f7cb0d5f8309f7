"""Stance: where the army waits, where its units are, and the way home; shared by ``defence`` and ``attack``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.opponent import bases, hands
from khala_simulator.opponent.levels import FASTER_LOOPS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.world.casts import Point

RALLY_AHEAD: Final = 7.0
"""How far in front of its town hall the army waits."""
RALLY_NEAR: Final = 9.0
REST_S: Final = 60.0
"""Between two attacks."""


def rally(side: OwnSide) -> Point:
    """Return where the army waits: in front of the base nearest to the enemy."""
    (x, y), (ex, ey) = bases.front(side), side.mind.enemy_start
    length = max(math.dist((x, y), (ex, ey)), 1.0)
    return x + (ex - x) / length * RALLY_AHEAD, y + (ey - y) / length * RALLY_AHEAD


def gather_up(side: OwnSide, army: list[int]) -> None:
    """Send units that do nothing elsewhere to where the army waits."""
    point = rally(side)
    lost = [s for s in army if idle(side, s) and math.dist(side.place(s), point) > RALLY_NEAR]
    if lost:
        hands.attack(side, lost, point)


def call_off(side: OwnSide) -> None:
    """End the attack; the army goes home."""
    mind = side.mind
    mind.attacking = False
    mind.waves += 1
    mind.attack_from = side.world.loop + round(REST_S * FASTER_LOOPS)
    point = rally(side)
    away = [s for s in side.army if math.dist(side.place(s), point) > RALLY_NEAR]
    if away:
        (hands.move if side.level.retreat else hands.attack)(side, away, point)


def nearer(at: Point, here: Point, there: Point) -> bool:
    """Return whether a place is nearer to one point than to another."""
    return math.dist(at, here) < math.dist(at, there)


def idle(side: OwnSide, slot: int) -> bool:
    """Return whether a unit has no order and fights nobody."""
    return bool(int(side.world.order_kind[slot]) == OrderKind.IDLE and side.world.target[slot] == NOBODY)


def bound_for(side: OwnSide, slot: int, point: Point, slack: float) -> bool:
    """Return whether a unit is on its way to a point already."""
    world = side.world
    walks = int(world.order_kind[slot]) in (OrderKind.ATTACK_MOVE, OrderKind.SCAN_MOVE)
    x, y = world.order_point[slot].tolist()
    return bool(walks) and math.dist((x, y), point) <= slack
